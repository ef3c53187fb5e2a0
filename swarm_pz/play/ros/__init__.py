"""The table for programs that speak ROS: messages of standard types, a rosbridge server, recordings as MCAP.

=================  ==========================================================================
`definitions`      the message types, as ROS 2 writes them, and messages as bytes (CDR)
`messages`         a moment of a game as messages of these types
`commands`         what ROS programs publish, as commands
`connection`       one client of the rosbridge: what it is sent
`rosbridge`        the rosbridge protocol, which knows nothing of games
`seat`             a seat at the table that a client plays
`robots`           robots of a lab: their poses and setpoints
`bridge`           all of these together, beside a table
`process`          where it runs
`mcap`             a recorded game as a file that ROS tools read
=================  ==========================================================================
"""
