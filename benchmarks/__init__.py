"""What the game, the controller and the simulator do, in numbers."""
