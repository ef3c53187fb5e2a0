// A player without libraries: a ring around the middle of the opposing drones. docs/bots.md has the protocol.
//
// g++ -O2 -o ring examples/bots/ring.cpp && swarm-pz evaluate exec:./ring --opponent noise

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>

const int GRID = 10;  // cells a side of what it asks to see

// The number after a name in a line of JSON, as "turn":3; 0 where there is none.
long number_after(const std::string& line, const std::string& name) {
  const size_t place = line.find("\"" + name + "\":");
  return place == std::string::npos ? 0 : std::strtol(line.c_str() + place + name.size() + 3, nullptr, 10);
}

// Find where the image after "see" is brightest on average, in map widths.
void find_middle(const std::string& line, double& x, double& y) {
  const char* rest = line.c_str() + line.find("\"see\":") + 6;
  double total = 0;
  x = y = 0;
  for (int cell = 0; cell < GRID * GRID; ++cell) {
    while (*rest == '[' || *rest == ']' || *rest == ',' || *rest == ' ') ++rest;
    char* end;
    const double value = std::strtod(rest, &end);
    rest = end;
    total += value;
    x += value * (cell % GRID + 0.5) / GRID;
    y += value * (cell / GRID + 0.5) / GRID;
  }
  x = total > 0 ? x / total : 0.5;
  y = total > 0 ? y / total : 0.5;
}

// Write a density, row by row from the bottom up: a ring around a point.
void write_ring(double x, double y, long cells) {
  for (long row = 0; row < cells; ++row) {
    std::cout << (row ? ",[" : "[[");
    for (long column = 0; column < cells; ++column) {
      const double away = std::hypot((column + 0.5) / cells - x, (row + 0.5) / cells - y);
      std::cout << (column ? "," : "") << std::exp(-std::pow((away - 0.25) / 0.1, 2));
    }
    std::cout << "]";
  }
  std::cout << "]";
}

int main() {
  std::cout.precision(17);
  long cells = 10;
  for (std::string line; std::getline(std::cin, line);) {
    if (line.find("\"swarm_pz\"") != std::string::npos) {
      cells = number_after(line, "command_cells");
      std::cout << "{\"swarm_pz\":1,\"observation\":{\"kind\":\"grids\",\"grid\":" << GRID
                << ",\"channels\":[\"opposing_positions\"]}}" << std::endl;
    } else if (line.find("\"see\"") != std::string::npos) {
      double x, y;
      find_middle(line, x, y);
      std::cout << "{\"turn\":" << number_after(line, "turn") << ",\"density\":";
      write_ring(x, y, cells);
      std::cout << "}" << std::endl;
    }
  }
}
