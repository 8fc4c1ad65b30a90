"""A model's MJCF made portable: the files that it names go with it, under names relative to its own folder."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from turnscrew.errors import ModelError

FOLDER = "assets"
"""Folder of the named files, beside the MJCF."""


def portable(xml: str) -> tuple[str, dict[str, bytes]]:
    """An MJCF text that names its files relative to itself, and those files.

    Only file names change, so both texts compile to the same model to the last bit.  (A model that is compiled
    from a spec, without the way through text, is another one: MuJoCo writes six significant digits.)

    Args:
        xml: MJCF as MuJoCo writes it; its meshes and textures are absolute paths or relative to `meshdir` and
            `texturedir`.

    Returns:
        The new text, and the content of each file by its new relative name.

    Raises:
        ModelError: A file is missing, or two different files have one name.
    """
    root = ElementTree.fromstring(xml)
    folders = {"mesh": "", "texture": ""}
    for compiler in root.iter("compiler"):
        for kind in folders:
            folders[kind] = compiler.attrib.pop(f"{kind}dir", folders[kind])
    assets: dict[str, bytes] = {}
    for kind, folder in folders.items():
        for element in root.iter(kind):
            file = element.get("file")
            if file is not None:
                content = _content(Path(folder) / file)
                name = f"{FOLDER}/{Path(file).name}"
                if assets.setdefault(name, content) != content:
                    raise ModelError(f"two different files are named {Path(file).name}: rename one")
                element.set("file", name)
    return ElementTree.tostring(root, encoding="unicode"), assets


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        raise ModelError(f"{path}: there is no such file") from None
