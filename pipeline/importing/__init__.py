"""Import of recordings from other programs and data sets as rig folders."""

from pipeline.importing.import_rig import ImportReport, is_recording, iterate_import

__all__ = ["ImportReport", "is_recording", "iterate_import"]
