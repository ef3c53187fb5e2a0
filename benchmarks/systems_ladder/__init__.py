"""The ladder of systems: which control system wins more often, and sooner, and what else it can.

Every system is commanded by the best of the scripts for its commands and the policy that was trained for it, against
one fixed adversary and against each other; and alone, its traits are measured.
"""
