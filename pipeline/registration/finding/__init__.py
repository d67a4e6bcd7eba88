"""The pose of two clouds from anywhere: few quick ways, evidence for each answer, and a verdict."""
