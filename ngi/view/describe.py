"""What varies, or could vary, in a scene: `ngi describe SCENE`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ngi.config.options import option, run_tool


@dataclass
class DescribeOptions:
    """Describes a variable scene, checks its camera, and lists the buffers that a run leaves out.
    For a plain Mitsuba file: lists what could vary and writes a scene.yaml to start from.

    ngi describe sphere-caustic
    ngi describe scenes/lamp/scene.xml
    """

    scene: str = option(
        "a scene's name or folder, a Mitsuba XML file, or a folder with a scene.xml"
    )
    backend: str = option("auto, cuda, llvm or scalar", "auto")


def describe(options: DescribeOptions) -> int:
    """Prints the description; 1 where something is wrong with the scene."""
    from ngi.machine.backend import activate
    from ngi.scene.folder import read_scene, scenes
    from ngi.view.scene_text import describe_file, describe_scene

    activate(options.backend)
    path = Path(options.scene)
    if path.name == "scene.yaml":
        path = path.parent
    document = path / "scene.xml" if path.is_dir() else path
    if (arguments := scenes().get(options.scene)) is not None:
        description = read_scene(**arguments)
    elif (path / "scene.yaml").is_file():
        description = read_scene(path)
    elif document.is_file() and document.suffix == ".xml" and not _of_the_authors(document):
        print(describe_file(document))
        return 0
    elif not path.exists():
        raise FileNotFoundError(
            f"{path}: no such file or folder, and no scene of this name; known scenes: "
            f"{', '.join(sorted(scenes()))}"
        )
    else:
        from ngi.scene.release import read_release

        description = read_release(path)
    text, problems = describe_scene(description)
    print(text)
    print("\ncamera:" + ("  in free space wherever it can move" if not problems else ""))
    for problem in problems:
        print(f"  error: {problem}")
    return 1 if problems else 0


def _of_the_authors(document: Path) -> bool:
    """Whether something in the file varies by its name."""
    from ngi.scene.release.tags import is_variable
    from ngi.scene.xml_file import read_xml

    return any(map(is_variable, read_xml(document)[0].iter()))


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi describe`."""
    return run_tool(describe, DescribeOptions, "ngi describe", arguments)
