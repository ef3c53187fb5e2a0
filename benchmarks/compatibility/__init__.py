"""What other libraries do with the environments: a file of rows each."""
