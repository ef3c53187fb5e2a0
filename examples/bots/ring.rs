// A player without crates: a ring around the middle of the opposing drones. docs/bots.md has the protocol.
//
// rustc -O -o ring examples/bots/ring.rs && swarm-pz evaluate exec:./ring --opponent noise

use std::io::{self, BufRead, Write};

const GRID: usize = 10; // cells a side of what it asks to see

/// Returns the number after a name in a line of JSON, as "turn":3; 0 where there is none.
fn number_after(line: &str, name: &str) -> usize {
    let key = format!("\"{name}\":");
    let rest = line.find(&key).map_or("", |place| &line[place + key.len()..]);
    let digits: String = rest.trim_start().chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap_or(0)
}

/// Returns where the image after "see" is brightest on average, in map widths.
fn middle(line: &str) -> (f64, f64) {
    let image = line.split("\"see\":").nth(1).unwrap_or("");
    let values = image.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter_map(|word| word.parse::<f64>().ok());
    let (mut total, mut x, mut y) = (0.0, 0.0, 0.0);
    for (cell, value) in values.take(GRID * GRID).enumerate() {
        total += value;
        x += value * ((cell % GRID) as f64 + 0.5) / GRID as f64;
        y += value * ((cell / GRID) as f64 + 0.5) / GRID as f64;
    }
    if total > 0.0 { (x / total, y / total) } else { (0.5, 0.5) }
}

/// Returns a density, row by row from the bottom up: a ring around a point.
fn ring((x, y): (f64, f64), cells: usize) -> Vec<Vec<f64>> {
    let along: Vec<f64> = (0..cells).map(|cell| (cell as f64 + 0.5) / cells as f64).collect();
    let value = |a: f64, b: f64| (-(((a - x).hypot(b - y) - 0.25) / 0.1).powi(2)).exp();
    along.iter().map(|&b| along.iter().map(|&a| value(a, b)).collect()).collect()
}

fn main() {
    let mut cells = 10;
    for line in io::stdin().lock().lines().map_while(Result::ok) {
        if line.contains("\"swarm_pz\"") {
            cells = number_after(&line, "command_cells");
            let sees = format!("{{\"kind\":\"grids\",\"grid\":{GRID},\"channels\":[\"opposing_positions\"]}}");
            println!("{{\"swarm_pz\":1,\"observation\":{sees}}}");
        } else if line.contains("\"see\"") {
            let turn = number_after(&line, "turn");
            println!("{{\"turn\":{turn},\"density\":{:?}}}", ring(middle(&line), cells));
        }
        io::stdout().flush().expect("whoever reads has ended");
    }
}
