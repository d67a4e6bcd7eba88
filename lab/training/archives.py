"""Furniture catalogues' archives: Debian packages, and the zip files inside them."""

from __future__ import annotations

import io
import lzma
import os
import re
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from packetmesh.errors import InputError

ZIP_SUFFIXES = (".sh3f", ".sh3t", ".jar", ".zip")
_AR_MAGIC = b"!<arch>\n"
_AR_HEADER_BYTES = 60


def zip_files(source: Path, cache: Path) -> list[Path]:
    """Return the zip files in a folder and below it, or in a package, or ``source`` itself; sorted by name.

    Args:
        source: a folder, a ``.deb`` or a zip file; packages inside a folder are opened too.
        cache: folder into which each package is unpacked once.

    Raises:
        InputError: there is no zip file, or a package cannot be read.
    """
    if not source.exists():
        raise InputError(f"There is no furniture at '{source}'; name a folder, a .deb or a .sh3f file.")
    below = sorted(file for file in source.rglob("*") if file.is_file()) if source.is_dir() else [source]
    found = [file for file in below if file.suffix.lower() in ZIP_SUFFIXES]
    for package in (file for file in below if file.suffix == ".deb"):
        found += _unpacked(package, cache / "packages" / package.stem)
    if not found:
        raise InputError(f"'{source}' holds no .sh3f, .jar, .zip or .deb file; name the furniture's folder.")
    return sorted(found, key=lambda file: file.name)


def _unpacked(package: Path, folder: Path) -> list[Path]:
    """Return the zip files of a Debian package, written to ``folder`` if they are not there yet."""
    done = folder / "unpacked"
    if not done.exists():
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in _zip_contents(package):
            temporary = folder / f"{name}.{os.getpid()}.tmp"
            temporary.write_bytes(content)
            temporary.rename(folder / name)
        done.touch()
    return [file for file in folder.iterdir() if file.suffix in ZIP_SUFFIXES]


def _zip_contents(package: Path) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each zip file in a Debian package.

    Raises:
        InputError: the package is damaged, or Python cannot decompress it.
    """
    archive_name, data = _data_of(package)
    try:
        with tarfile.open(fileobj=io.BytesIO(data)) as archive:
            for member in archive:
                name = PurePosixPath(member.name).name
                content = archive.extractfile(member) if name.endswith(ZIP_SUFFIXES) else None
                if content is not None:
                    yield name, content.read()
    except (tarfile.TarError, EOFError, OSError, lzma.LZMAError, zlib.error):  # bz2 and gzip raise OSError
        raise InputError(
            f"'{package}' is damaged or its {archive_name} unreadable; download it again, or unpack it "
            "with dpkg -x."
        ) from None


def _data_of(package: Path) -> tuple[str, bytes]:
    """Return name and content of the tar archive in a Debian package, an ``ar`` archive of three members.

    Raises:
        InputError: there is none.
    """
    with package.open("rb") as stream:
        if stream.read(len(_AR_MAGIC)) != _AR_MAGIC:
            raise InputError(f"'{package}' is no Debian package; download it again.")
        while (header := stream.read(_AR_HEADER_BYTES))[48:58].strip().isdigit():
            name, size = header[:16].decode("ascii", "replace").strip(" /"), int(header[48:58])
            if name.startswith("data.tar"):
                return name, stream.read(size)
            stream.seek(size + size % 2, io.SEEK_CUR)
    raise InputError(f"'{package}' holds no files; download it again.")


def numbered_records(file: Path, suffix: str) -> Iterator[dict[str, str]]:
    """Yield the numbered records of the catalogues in a zip file.

    Args:
        file: zip file with Java properties whose names end in ``suffix``, in lines like ``width#3=60``.
        suffix: for example ``FurnitureCatalog.properties``.

    Raises:
        InputError: the file is no zip file.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            texts = [archive.read(name) for name in archive.namelist() if name.endswith(suffix)]
    except (zipfile.BadZipFile, OSError):
        raise InputError(f"'{file}' is no readable zip file; download it again.") from None
    for text in texts:
        records: dict[int, dict[str, str]] = {}
        for line in text.decode("latin-1").splitlines():
            match = re.match(r"\s*(\w+)#(\d+)\s*[=:]\s*(.*)", line)
            if match:
                key, number, value = match.groups()
                records.setdefault(int(number), {})[key] = value.strip()
        yield from records.values()
