"""Display settings of a reconstruction: cuts, wireframe, size of points, light, scale bar and axes. They
change only the view and pictures of it.
"""
