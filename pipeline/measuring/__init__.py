"""Lengths, angles, areas and boxes on a reconstructed surface, each with its 95 % interval (SPEC 11); imports
the stages of the pipeline and their records, but nothing that writes folders."""
