"""Robot models and what follows from joints: poses, Jacobians, status and turn, confdata, limits, paths.

The rest of respot uses

- `robots.find_robot`, `robot_file.read_robot_file`: a `RobotModel` by name or from a TOML file;
- `from_backup.cell_of`: the `RobotCell` that a backup's own machine data describe; `RobotCell.at` puts one that moves
  with an external axis where a target's external axes say;
- `configuration.reconfigure`: status and turn, or confdata, of moved targets;
- `path`: singularities, branch changes and joint travel along a program.

Joints are in the maker's own zero and sign, degrees (mm for a linear axis). Lengths are mm.
"""
