"""The compiled controllers: from a team's command and its drones' past to accelerations.

=================  ======================================================
`ergodic`          receding-horizon control towards a density
`communication`    the same with a limited communication radius
`plans`            the same with warm starts from the last solve's plans
`flocking`         alignment, cohesion, separation, and an attractor
`coverage`         towards the centroids of Voronoi cells
`potential_field`  repulsion between drones, and images of charges
=================  ======================================================

A controller's file holds its kernel, and its numbers as a named tuple. The ergodic one runs in the loop over games;
others are called by their control systems in `swarm_pz.systems`.
"""
