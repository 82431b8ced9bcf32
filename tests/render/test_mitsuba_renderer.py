"""Radiance against `mi.render`, and what every renderer promises of its patches."""

import shutil

import numpy as np
import pytest
import torch

from ngi.machine.backend import dr, mi
from ngi.render.mitsuba_renderer import HalvesRenderer, MitsubaRenderer
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.render.box import V, states


def z_scores(a, b):
    """Welch's statistic, where there is noise, of independent renderings along the first axis."""
    variance = a.var(0, ddof=1) / len(a) + b.var(0, ddof=1) / len(b)
    noisy = variance > 1e-12
    assert noisy.mean() > 0.4
    np.testing.assert_allclose(a.mean(0)[~noisy], b.mean(0)[~noisy], rtol=1e-5)
    return (a.mean(0) - b.mean(0))[noisy] / np.sqrt(variance[noisy])


def images(renderer, count, seed=0):
    return np.stack(
        [
            renderer.render_image(V, resolution=32, samples_per_pixel=32, seed=seed + i)
            for i in range(count)
        ]
    )


@pytest.fixture(scope="module", params=["llvm", "scalar"])
def renderer(request, load_box):
    return load_box(request.param, buffer_samples=1, patch_size=16)


def test_radiance_agrees_with_mitsubas_own_renderer(renderer, box_folder) -> None:
    ours = images(renderer, 12)
    scene = VariableScene(read_scene(box_folder))
    scene.apply(V)
    theirs = np.stack([np.array(mi.render(scene.scene, spp=32, seed=i)) for i in range(12)])
    z = z_scores(ours, theirs)
    means = ours.mean((1, 2, 3)), theirs.mean((1, 2, 3))
    standard_error = np.sqrt(sum(mean.var(ddof=1) / len(mean) for mean in means))
    assert standard_error < 0.01 * theirs.mean()
    assert abs(means[0].mean() - means[1].mean()) < 4 * standard_error
    assert 0.8 < np.mean(z**2) < 1.3  # 22 / 20 for Student's t of 22 degrees of freedom
    assert np.mean(abs(z) > 4) < 5e-3


def test_scalar_and_llvm_agree(load_box) -> None:
    a, b = (load_box(name, buffer_samples=1, patch_size=16) for name in ("llvm", "scalar"))
    z = z_scores(images(a, 12), images(b, 12))
    assert 0.8 < np.mean(z**2) < 1.3
    buffers = [r.image_buffers(V, resolution=32) for r in (a, b)]
    different = ((buffers[0] - buffers[1]).abs() > 1e-3).any(-1)
    assert different.float().mean() < 0.01  # rays that meet an edge


PIXELS = torch.tensor([3, 40 * 48 + 7, 48 * 48 - 1, 3, 20 * 48 + 33])
"""Of an image of 48 x 48; one twice."""


def test_listed_pixels_are_those_of_the_image(renderer, monkeypatch) -> None:
    image = renderer.image_buffers(V, resolution=48).flatten(0, 1)
    listed = renderer.pixel_buffers(V, PIXELS, resolution=48)
    torch.testing.assert_close(listed, image[PIXELS], atol=1e-5, rtol=0)
    other = renderer.image_buffers(V, resolution=48, samples=4).flatten(0, 1)
    listed_other = renderer.pixel_buffers(V, PIXELS, resolution=48, samples=4)
    torch.testing.assert_close(listed_other, other[PIXELS], atol=1e-5, rtol=0)
    assert not torch.equal(listed_other, listed)
    assert listed[:, :3].std(dim=0).max() > 0.01
    monkeypatch.setattr("ngi.render.mitsuba_renderer.PATHS_PER_LAUNCH", 2)
    torch.testing.assert_close(renderer.pixel_buffers(V, PIXELS, resolution=48), listed)


def test_listed_pixels_follow_v_and_their_number(load_box) -> None:
    """Dr.Jit replays what it recorded of another v, and of other lists."""
    renderer = load_box("llvm", buffer_samples=4, patch_size=16)
    for v in (V, V.flip(0), V):
        for pixels in (PIXELS, PIXELS[:2], PIXELS.flip(0)):
            image = renderer.image_buffers(v, resolution=48).flatten(0, 1)
            listed = renderer.pixel_buffers(v, pixels, resolution=48)
            torch.testing.assert_close(listed, image[pixels], atol=1e-5, rtol=0)


def test_patch_is_a_crop_of_the_image(renderer) -> None:
    position = torch.tensor([[0.37, 0.81]])
    x, y = 12, 26  # floor(0.37 * 33), floor(0.81 * 33)
    state = torch.cat([V[None], position], 1)
    patches = [renderer.render_patches(state, resolution=48, seed=i) for i in range(16)]
    image = renderer.render_image(V, resolution=48, samples_per_pixel=256, seed=0)
    buffers = renderer.image_buffers(V, resolution=48)
    torch.testing.assert_close(
        patches[0].buffers[0], buffers[y : y + 16, x : x + 16], atol=1e-5, rtol=0
    )
    radiance = torch.stack([p.log_radiance[0].expm1() for p in patches]).mean(0)
    crop = image[y : y + 16, x : x + 16]
    assert abs(radiance.mean() / crop.mean() - 1) < 0.03
    correlation = torch.corrcoef(torch.stack([radiance.flatten(), crop.flatten()]))[0, 1]
    assert correlation > 0.95


def test_equal_seeds_give_equal_bits_and_others_do_not(renderer) -> None:
    a, b, c = (renderer.render_patches(states(3), resolution=40, seed=s) for s in (5, 5, 6))
    assert torch.equal(a.log_radiance, b.log_radiance)
    assert torch.equal(a.buffers, b.buffers)
    assert not torch.equal(a.log_radiance, c.log_radiance)
    assert torch.equal(a.buffers, c.buffers)


def test_a_patch_does_not_depend_on_the_rest_of_its_batch(renderer) -> None:
    batch = renderer.render_patches(states(4), resolution=40, seed=1)
    order = [2, 0]
    part = renderer.render_patches(states(4)[order], resolution=40, seed=1)
    assert torch.equal(part.log_radiance, batch.log_radiance[order])
    assert torch.equal(part.buffers, batch.buffers[order])


def test_results_are_not_changed_by_later_work(renderer) -> None:
    first = renderer.render_patches(states(2), resolution=40, seed=1)
    copy = first.log_radiance.clone(), first.buffers.clone()
    renderer.render_patches(states(2, seed=9), resolution=40, seed=2)
    assert torch.equal(first.log_radiance, copy[0])
    assert torch.equal(first.buffers, copy[1])


def test_counts_shapes_and_an_empty_batch(renderer) -> None:
    patches = renderer.render_patches(states(2), resolution=16, seed=0)
    assert patches.buffers.shape == (2, 16, 16, renderer.layout.channels)
    assert patches.log_radiance.shape == (2, 16, 16, 3)
    assert (patches.repaired, patches.masked, patches.paths) == (0, 0, 2 * 16 * 16 * 8)
    assert len(renderer.render_patches(states(0), resolution=16, seed=0).buffers) == 0


def test_nothing_is_compiled_after_warm_up(load_box) -> None:
    renderer = load_box("llvm", patch_size=16)
    renderer.render_patches(states(2), resolution=32, seed=0)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        for i in range(25):
            renderer.render_patches(states(4, seed=i), resolution=32 + 17 * i, seed=i)
        kernels = dr.kernel_history([dr.KernelType.JIT])
    assert len(kernels) >= 200
    assert all(kernel["cache_hit"] for kernel in kernels)


def test_scalar_images_follow_the_camera(box_folder) -> None:
    renderer = MitsubaRenderer(
        scene=read_scene(box_folder), backend="scalar", buffer_samples=1, patch_size=16
    )
    still = renderer.render_image(V, resolution=32, samples_per_pixel=16, seed=0)
    scene = renderer._scene.scene
    camera = mi.traverse(scene.sensors()[0])
    camera["x_fov"] = 25.0
    camera["to_world"] = mi.ScalarTransform4f().look_at([0.5, 1.5, 3], [0, 1, 0], [0, 1, 0])
    camera.update()
    moved = renderer.render_image(V, resolution=32, samples_per_pixel=16, seed=0)
    truth = torch.from_numpy(np.array(mi.render(scene, spp=16, seed=1)))
    assert (moved - truth).abs().mean() < 0.2 * (still - truth).abs().mean()
    emission = renderer.image_buffers(V, resolution=32)[..., renderer.layout.slice("emission")]
    torch.testing.assert_close((moved > 5).all(-1), (emission > 1).all(-1))


def test_a_patch_in_halves_is_the_mean_of_two_independent_ones(load_box) -> None:
    """Each of the halves as a renderer with so many samples has it; of the same cost as one."""
    halves = load_box("llvm", buffer_samples=1, patch_size=16, halves=True)
    whole = load_box("llvm", buffer_samples=1, patch_size=16)
    half = load_box("llvm", buffer_samples=1, patch_size=16, samples_per_pixel=4)
    given = {"states": states(24), "resolution": 40, "seed": 3}
    found, one, single = (r.render_patches(**given) for r in (halves, whole, half))
    assert (found.paths, found.repaired, found.masked) == (one.paths, 0, 0)
    assert torch.equal(found.buffers, one.buffers)
    assert one.first_half is None
    assert torch.equal(found.first_half, single.log_radiance)

    seeds = [halves.render_patches(states(3), resolution=40, seed=i) for i in range(40)]
    means, first = (
        torch.stack([getattr(each, name).expm1() for each in seeds])
        for name in ("log_radiance", "first_half")
    )
    both = torch.stack([first, 2 * means - first]).clamp(max=2)  # without fireflies
    noise = (both - both.mean(dim=1, keepdim=True)).flatten(1)  # of each pixel, over the seeds
    assert noise.std(dim=1).min() > 0.05
    assert noise.std(dim=1).max() < 1.1 * noise.std(dim=1).min()
    assert torch.corrcoef(noise.sign())[0, 1].abs() < 0.02


@pytest.mark.parametrize("backend", ["llvm", "scalar"])
def test_furnace(tmp_path, backend, load_box) -> None:
    """A white sphere under a constant sky of radiance 1 is invisible."""
    load_box(backend)  # skips where the backend is missing
    (tmp_path / "scene.xml").write_text(
        """<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="4"/></integrator>
        <sensor type="perspective"><float name="fov" value="40"/>
          <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
          <film type="hdrfilm"><integer name="width" value="8"/>
            <integer name="height" value="8"/></film></sensor>
        <shape type="sphere" id="ball"><bsdf type="diffuse" id="white">
          <rgb name="reflectance" value="0.5"/></bsdf></shape>
        <emitter type="constant"><rgb name="radiance" value="1"/></emitter></scene>"""
    )
    (tmp_path / "scene.yaml").write_text(
        "{name: furnace, scene: scene.xml, samples_per_pixel: 1, max_depth: 4,\n"
        "bounds: {minimum: [-1, -1, -1], maximum: [1, 1, 1]},\n"
        "variables: [{object: white, property: albedo, minimum: [0, 0, 0], maximum: [1, 1, 1]}],\n"
        "camera_path: [[0, 0, 0]], hard_frames: [[1, 1, 1]]}"
    )
    furnace = MitsubaRenderer(
        scene=read_scene(tmp_path), backend=backend, patch_size=4, buffer_samples=64
    )
    assert furnace.layout.names == ("position", "normal", "outgoing", "albedo", "emission")
    image = furnace.render_image(torch.ones(3), resolution=16, samples_per_pixel=256, seed=0)
    buffers = furnace.image_buffers(torch.ones(3), resolution=16)
    sky = (buffers[..., furnace.layout.slice("albedo")] == 0).all(-1)
    ball = (buffers[..., furnace.layout.slice("albedo")] == 1).all(-1)
    assert sky.any()
    sky_radiance = image[sky]
    torch.testing.assert_close(sky_radiance, torch.ones_like(sky_radiance), atol=0.01, rtol=0)
    emission = buffers[..., furnace.layout.slice("emission")]
    torch.testing.assert_close(emission[sky], torch.ones(int(sky.sum()), 3).log1p())
    assert (emission[ball] == 0).all()
    assert abs(image[ball].mean() - 1) < 0.01
    ball_radiance = image[ball]
    torch.testing.assert_close(ball_radiance, torch.ones_like(ball_radiance), atol=0.2, rtol=0)


@pytest.mark.parametrize(
    ("bad", "resolution", "message"),
    [
        (torch.rand(2, 11), 40, r"shape \[2, 11\]: expected \[n, 12\]"),
        (torch.full((1, 12), 1.5), 40, r"states\[0, 0\] is 1.5; expected 0 to 1"),
        (torch.full((1, 12), torch.nan), 40, r"states\[0, 0\] is nan"),
        (torch.rand(1, 12), 15, "patch of 16 pixels is larger than the image of 15"),
    ],
)
def test_bad_states(renderer, bad, resolution, message) -> None:
    with pytest.raises(ValueError, match=message):
        renderer.render_patches(bad, resolution=resolution, seed=0)


def test_a_picture_is_that_of_the_path_tracer_in_an_aov(box_folder, tmp_path) -> None:
    shutil.copytree(box_folder, tmp_path, dirs_exist_ok=True)
    xml = (tmp_path / "scene.xml").read_text()
    begin, rest = xml.split('<integrator type="path">')
    aov = '<integrator type="aov"><string name="aovs" value="a:albedo"/>'
    inner = rest.replace("</integrator>", "</integrator></integrator>", 1)
    pictures = []
    for text in (xml, f'{begin}{aov}<integrator type="path" name="image">{inner}'):
        (tmp_path / "scene.xml").write_text(text)
        made = MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar", patch_size=4)
        pictures.append(made.render_image(V, resolution=8, samples_per_pixel=4, seed=1))
    assert torch.equal(*pictures)


def test_bad_construction(box_folder, tmp_path) -> None:
    with pytest.raises(ValueError, match="patch_size is 0"):
        MitsubaRenderer(scene=read_scene(box_folder), backend="scalar", patch_size=0)
    with pytest.raises(ValueError, match=r"samples_per_pixel is 7; renderer\.halves=true needs an"):
        HalvesRenderer(scene=read_scene(box_folder), backend="scalar", samples_per_pixel=7)
    with pytest.raises(ValueError, match="backend 'metal': choose one of"):
        MitsubaRenderer(scene=read_scene(box_folder), backend="metal")
    shutil.copytree(box_folder, tmp_path, dirs_exist_ok=True)
    xml = (tmp_path / "scene.xml").read_text()
    (tmp_path / "scene.xml").write_text(
        xml.replace('name="width" value="32"', 'name="width" value="33"')
    )
    with pytest.raises(ValueError, match="film is 33 x 32; make width and height equal"):
        MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar")
    height = '<integer name="height" value="32"/>'
    assert height in xml
    (tmp_path / "scene.xml").write_text(
        xml.replace(height, f'{height}<integer name="crop_height" value="16"/>')
    )
    with pytest.raises(ValueError, match="the film is cropped"):
        MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar")
    (tmp_path / "scene.xml").write_text(xml.replace('type="roughplastic"', 'type="pplastic"'))
    named = "BSDF 'clay' is a .*; use one of diffuse, conductor, .*, roughplastic, principled, or"
    with pytest.raises(ValueError, match=named):
        MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar")


FOG = '<medium type="homogeneous" id="fog"/>'


@pytest.mark.parametrize(("before", "inside"), [(FOG, '<ref id="fog"/>'), ("", FOG)])
def test_a_camera_in_a_medium_is_refused(box_folder, tmp_path, before, inside) -> None:
    """No picture would show it, the references neither."""
    shutil.copytree(box_folder, tmp_path, dirs_exist_ok=True)
    sensor = '<sensor type="perspective" id="camera">'
    text = (tmp_path / "scene.xml").read_text()
    assert sensor in text
    (tmp_path / "scene.xml").write_text(text.replace(sensor, f"{before}{sensor}{inside}"))
    with pytest.raises(ValueError, match=r"scene\.xml, line 7: the camera is in a medium"):
        MitsubaRenderer(scene=read_scene(tmp_path), backend="scalar")
