"""`python -m swarm_pz`: the command line."""

from swarm_pz.cli import main

if __name__ == "__main__":
    main()
