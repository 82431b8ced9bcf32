"""An update of a scene in place, and the same scene written with the value."""

import gc
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ngi.machine.backend import a_worker_thread, activate, mi
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.scene.stage import disagreement, pictures

FAMILY_LEVEL = 0.01


@dataclass(frozen=True)
class Update:
    """variables: entries of scene.yaml.

    v: where to. off: a place modestly beside it, which must be told from v.
    before: edit of the XML for both scenes. edit, files: of the XML and of the files of the scene
        that is written with the value.
    """

    name: str
    variables: list[dict]
    v: list[float]
    off: list[float]
    edit: Callable | None = None
    scene: str = "stage"
    before: Callable | None = None
    files: Callable | None = None


def together(name, updates, *names):
    """One scene with the updates of these names, which do not act on the same things."""
    chosen = [next(update for update in updates if update.name == name) for name in names]
    assert len({update.scene for update in chosen}) == 1

    def each(part):
        functions = [getattr(u, part) for u in chosen if getattr(u, part) is not None]
        return lambda argument: [function(argument) for function in functions]

    return Update(
        name,
        scene=chosen[0].scene,
        variables=[variable for update in chosen for variable in update.variables],
        v=[u for update in chosen for u in update.v],
        off=[u for update in chosen for u in update.off],
        **{part: each(part) for part in ("before", "edit", "files")},
    )


def scene_of(update, make_scene):
    """The folder of the scene that is updated."""
    return make_scene(update.scene, update.variables, dimensions=len(update.v), edit=update.before)


def written_pictures(update, make_scene):
    """Of the scene written with the value, in the scalar variant, the simplest one."""
    folder = make_scene(
        update.scene,
        update.variables,
        dimensions=len(update.v),
        edit=lambda root: [edit(root) for edit in (update.before, update.edit) if edit],
    )
    if update.files is not None:
        update.files(folder)
    activate("scalar")
    with a_worker_thread():
        scene = mi.load_file(str(folder / "scene.xml"), optimize=False)
    return pictures(scene, 1000)


def check_update(update, backend, make_scene) -> None:
    """Moves a scene elsewhere and to v, and compares it with pictures of the written one.

    Then to what is off, which must be told from it.
    """
    written = written_pictures(update, make_scene)
    folder = scene_of(update, make_scene)
    activate(backend)
    scene = VariableScene(read_scene(folder))
    scene.apply(np.linspace(0, 1, len(update.v)))
    mi.render(scene.scene, spp=1)
    scene.apply(update.v)
    assert disagreement(pictures(scene.scene, 2000), written) > FAMILY_LEVEL
    scene.apply(update.off)
    off = pictures(scene.scene, 3000)
    assert disagreement(off, written) < FAMILY_LEVEL, "the comparison is blind"
    del scene
    gc.collect()  # scenes that are not collected slow Dr.Jit down
