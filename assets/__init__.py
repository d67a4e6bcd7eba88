"""What ships beside the code: demo rigs and the depth network, each made by a script in this repository."""
