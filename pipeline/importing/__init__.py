"""Other people's recordings as rig folders: colour and depth images in the layouts of the field."""

from pipeline.importing.import_rig import ImportReport, iterate_import

__all__ = ["ImportReport", "iterate_import"]
