"""A contact sheet of every scene, to be looked at: `ngi gallery`."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ngi.config.options import option, run_tool


@dataclass
class GalleryOptions:
    """Makes a contact sheet of every scene: random configurations, hard frames and buffers.

    ngi gallery mirror salon-9 configurations=4
    """

    scenes: list[str] | None = option("names of scenes; default: all", None)
    folder: str = option("folder to write to", "outputs/gallery")
    configurations: int = option("number of random v per scene", 8)
    resolution: int = option("pixels a side", 160)
    samples_per_pixel: int = option("of every picture", 64)
    backend: str = option("auto, cuda, llvm or scalar", "auto")


def write_sheets(options: GalleryOptions) -> None:
    """A picture per scene; ValueError for an unknown one, before anything is rendered."""
    from tqdm import tqdm

    from ngi.render.mitsuba_renderer import MitsubaRenderer
    from ngi.scene.folder import read_scene, scenes
    from ngi.view.contact_sheet import contact_sheet

    known = scenes()
    names = options.scenes or sorted(known)
    if unknown := set(names) - set(known):
        raise ValueError(f"no scene {sorted(unknown)}; there are {sorted(known)}")
    if options.configurations < 1:
        raise ValueError(f"configurations: {options.configurations}: give at least 1")
    folder = Path(options.folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in tqdm(names, desc="scenes"):
        scene = read_scene(**known[name])
        with closing(MitsubaRenderer(scene=scene, backend=options.backend)) as renderer:
            sheet = contact_sheet(
                renderer,
                configurations=options.configurations,
                resolution=options.resolution,
                samples_per_pixel=options.samples_per_pixel,
            )
            sheet.save(folder / f"{name}.jpg", quality=85)
        tqdm.write(f"{folder / name}.jpg")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi gallery`."""
    return run_tool(write_sheets, GalleryOptions, "ngi gallery", arguments)
