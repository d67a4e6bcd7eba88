"""What the computing processes do for the app: the chain's stages, remembered on disk, and slim views.

The clouds of a rig weigh hundreds of megabytes, so they stay with the computing processes and in a
folder that these share; only what the browser shows reaches the serving process.
"""
