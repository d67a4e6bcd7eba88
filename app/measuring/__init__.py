"""The measuring tool that the screens Scene, Surface and Network share: its folder, its drawing and its
part of the address. Only ``work`` and ``results`` compute, in another process.
"""
