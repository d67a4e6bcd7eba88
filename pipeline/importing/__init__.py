"""Other people's recordings as rig folders: colour and depth images in the layouts of the field."""

from pipeline.importing.import_rig import ImportReport, is_recording, iterate_import

__all__ = ["ImportReport", "is_recording", "iterate_import"]
