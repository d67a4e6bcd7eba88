"""Import of recordings from other programs and data sets, as rig folders or in TUM's form."""

from pipeline.importing.import_rig import ImportReport, is_recording, iterate_import
from pipeline.importing.kept import KeptReport, iterate_keep

__all__ = ["ImportReport", "KeptReport", "is_recording", "iterate_import", "iterate_keep"]
