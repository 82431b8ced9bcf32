"""Images of the spaceship: deck, hull panels, displays, and the planet and stars outside."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise
from PIL import Image, ImageDraw

TILE = 256
CYAN, AMBER, RED, GREEN = (90, 215, 235), (250, 180, 70), (240, 80, 60), (120, 225, 150)


def seams(x: np.ndarray, y: np.ndarray, width: float, height: float, gap: float) -> np.ndarray:
    """1 on the joints between plates of width x height in rows shifted by half a plate, else 0."""
    row = np.floor(y / height)
    across = (x / width + 0.5 * (row % 2)) % 1
    edge = np.minimum(np.minimum(across, 1 - across) * width, np.abs(y / height % 1) * height)
    return (edge < gap).astype(float)


def hull_panels(pixels: int) -> np.ndarray:
    """Plates of two by two metres, repeating, sRGB [pixels, pixels, 3]."""
    x, y = pixel_grid((2.0, 2.0), (pixels, pixels))
    row = np.floor(y / 0.5)
    plate = hash_noise(np.floor(x + 0.5 * (row % 2)) % 2, row)
    dirt = np.abs(fractal_noise(x % 2 * 3, y * 3) - 0.5)
    tone = 0.9 + 0.1 * plate - 0.15 * dirt
    bolts = np.hypot(((x * 4 + 0.5) % 1 - 0.5) / 4, y % 0.5 - 0.04) < 0.009
    tone = tone * (1 - 0.55 * seams(x, y, 1.0, 0.5, 0.006)) * (1 - 0.35 * bolts)
    return np.array([214.0, 216, 214]) * tone[..., None]


def deck_plates(pixels: int) -> np.ndarray:
    """Floor of two by two metres, repeating: dark plates with raised studs."""
    x, y = pixel_grid((2.0, 2.0), (pixels, pixels))
    stud = np.hypot((x * 20) % 1 - 0.5, (y * 20) % 1 - 0.5) < 0.3
    worn = fractal_noise(x * 6, y * 6)
    inside = ((x % 1) > 0.08) & ((x % 1) < 0.92) & ((y % 1) > 0.08) & ((y % 1) < 0.92)
    tone = (0.85 + 0.3 * worn) * (1 + 0.28 * (stud & inside))
    tone = tone * (1 - 0.6 * seams(x, y, 1.0, 1.0, 0.008))
    return np.array([118.0, 124, 132]) * tone[..., None]


def outer_space(width: int) -> np.ndarray:
    """Environment [width / 2, width, 3]: a blue planet below the bow, and stars.

    The left edge of the image is the direction -z, a quarter to its right +x; the top is +y.
    """
    longitude = (np.arange(width) + 0.5) / width * 2 * np.pi
    latitude = np.pi / 2 - (np.arange(width // 2) + 0.5) / width * 2 * np.pi
    a, b = np.meshgrid(longitude, latitude)
    ray = np.stack([np.cos(b) * np.sin(a), np.sin(b), -np.cos(b) * np.cos(a)], axis=-1)
    centre = np.array([0.55, -0.72, -1.0])
    centre /= np.linalg.norm(centre)
    angle = np.arccos(np.clip(ray @ centre, -1, 1))
    radius = 0.82
    rim = np.clip((radius - angle) / 0.006, 0, 1)
    land = fractal_noise(ray[..., 0] * 4 + 40, ray[..., 2] * 4 + ray[..., 1] * 3 + 40)
    swirl = fractal_noise(ray[..., 0] * 5 + 9 * land, ray[..., 1] * 16 + ray[..., 2] * 7 + 60, 5)
    cloud = np.clip((swirl - 0.47) * 4.5, 0, 1)
    ground = np.where((land > 0.56)[..., None], np.array([96.0, 84, 58]), np.array([22.0, 62, 120]))
    planet = ground * (1 - cloud[..., None]) + np.array([205.0, 214, 224]) * cloud[..., None]
    sunward = np.clip(ray @ np.array([-0.75, 0.45, -0.5]) * 1.4 + 0.1, 0.03, 1)
    haze = np.exp(-np.abs(angle - radius) / 0.03)[..., None] * sunward[..., None] ** 0.5
    image = planet * sunward[..., None] * rim[..., None] + np.array([70.0, 130, 210]) * haze
    cell = hash_noise(np.arange(width)[None, :], np.arange(width // 2)[:, None])
    stars = (cell > 0.997) * ((cell - 0.997) / 0.003) ** 2
    nebula = np.clip(fractal_noise(a * 3 + 30, b * 3 + 50, 5) - 0.5, 0, 1) * (1 - value_noise(a, b))
    sky = stars[..., None] * np.array([235.0, 240, 255])
    sky = sky + nebula[..., None] * np.array([90.0, 70, 130])
    return image + sky * (1 - rim[..., None]) * np.clip(1 - haze, 0, 1)


def displays() -> np.ndarray:
    """Eight square displays side by side in two rows, sRGB [512, 1024, 3]."""
    sheet = Image.new("RGB", (4 * TILE, 2 * TILE), (4, 8, 12))
    painters = (orbits, bars, waves, text_lines, radar, gauges, terrain, ship_plan)
    for number, paint in enumerate(painters):
        tile = Image.new("RGB", (TILE, TILE), (5, 14, 20))
        draw = ImageDraw.Draw(tile)
        paint(draw, number)
        draw.rectangle((6, 6, TILE - 7, TILE - 7), outline=(30, 90, 105), width=2)
        sheet.paste(tile, (number % 4 * TILE, number // 4 * TILE))
    return np.asarray(sheet, dtype=float)


def chance(count: int, seed: int) -> np.ndarray:
    return hash_noise(np.arange(count), np.full(count, 7 + seed))


def orbits(draw: ImageDraw.ImageDraw, seed: int) -> None:
    for radius, colour in ((30, AMBER), (58, CYAN), (86, CYAN), (108, (40, 110, 125))):
        box = (128 - radius, 128 - 0.6 * radius, 128 + radius, 128 + 0.6 * radius)
        draw.ellipse(box, outline=colour, width=2)
        angle = 6.28 * chance(1, seed + radius)[0]
        x, y = 128 + radius * np.cos(angle), 128 + 0.6 * radius * np.sin(angle)
        draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=colour)
    draw.ellipse((116, 116, 140, 140), fill=AMBER)


def bars(draw: ImageDraw.ImageDraw, seed: int) -> None:
    for i, level in enumerate(chance(12, seed)):
        top = 210 - 150 * level
        draw.rectangle((26 + 17 * i, top, 37 + 17 * i, 215), fill=RED if level > 0.85 else CYAN)
    draw.line((20, 220, 236, 220), fill=AMBER, width=3)


def waves(draw: ImageDraw.ImageDraw, seed: int) -> None:
    x = np.arange(20, 237, 2)
    for row, colour in enumerate((GREEN, CYAN, AMBER)):
        height = np.sin(x * (0.07 + 0.05 * row)) * np.sin(x * 0.021 + seed) * 28
        points = np.column_stack([x, 55 + 70 * row - height]).ravel().tolist()
        draw.line(points, fill=colour, width=3)


def text_lines(draw: ImageDraw.ImageDraw, seed: int) -> None:
    length = chance(40, seed)
    for row in range(13):
        left = 22
        for word in range(3):
            width = 18 + 50 * length[3 * row + word]
            colour = AMBER if length[row + word] > 0.85 else (70, 165, 180)
            draw.rectangle((left, 22 + 17 * row, left + width, 29 + 17 * row), fill=colour)
            left += width + 8


def radar(draw: ImageDraw.ImageDraw, seed: int) -> None:
    for radius in (100, 70, 40):
        box = (128 - radius, 128 - radius, 128 + radius, 128 + radius)
        draw.ellipse(box, outline=(50, 150, 95), width=2)
    draw.pieslice((28, 28, 228, 228), -70, -30, fill=(30, 120, 70))
    draw.line((28, 128, 228, 128), fill=(50, 150, 95), width=1)
    draw.line((128, 28, 128, 228), fill=(50, 150, 95), width=1)
    for x, y in zip(chance(6, seed), chance(6, seed + 1), strict=True):
        x, y = 60 + 136 * x, 60 + 136 * y
        draw.ellipse((x - 4, y - 4, x + 4, y + 4), fill=GREEN)


def gauges(draw: ImageDraw.ImageDraw, seed: int) -> None:
    for i, level in enumerate(chance(4, seed)):
        x, y = 70 + 116 * (i % 2), 70 + 116 * (i // 2)
        draw.arc((x - 44, y - 44, x + 44, y + 44), 140, 400, fill=(40, 100, 115), width=9)
        draw.arc((x - 44, y - 44, x + 44, y + 44), 140, 140 + 260 * level, fill=AMBER, width=9)
        draw.rectangle((x - 14, y - 6, x + 14, y + 6), fill=CYAN)


def terrain(draw: ImageDraw.ImageDraw, seed: int) -> None:
    x = np.arange(14, 243, 4)
    for row in range(12):
        ridge = fractal_noise(x / 38 + 9 * row, np.full(len(x), row * 0.7 + seed)) - 0.4
        points = np.column_stack([x, 60 + 15 * row - 70 * ridge]).ravel().tolist()
        draw.line(points, fill=(60, 120 + 9 * row, 150), width=2)


def ship_plan(draw: ImageDraw.ImageDraw, seed: int) -> None:
    hull = [(128, 26), (158, 80), (166, 190), (210, 214), (210, 226), (46, 226), (46, 214)]
    draw.polygon([*hull, (90, 190), (98, 80)], outline=CYAN, width=3)
    for i, level in enumerate(chance(5, seed)):
        fill = RED if level > 0.8 else (40, 110, 125)
        draw.rectangle((112, 84 + 26 * i, 144, 102 + 26 * i), fill=fill)
