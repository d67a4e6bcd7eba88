"""How a person looks at a reconstruction: cuts, wireframe, size of points, light, scale bar and axes. Nothing
of it changes what is measured or exported.
"""
