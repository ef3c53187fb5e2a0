"""The table for programs that speak ROS: messages of standard types, a rosbridge server, recordings as MCAP.

=================  =======================================================
`definitions`      the message types that are published, as ROS 2 writes them
`messages`         a moment of a game as messages of these types
`mcap`             a recorded game as a file that ROS tools read
=================  =======================================================
"""
