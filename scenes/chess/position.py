"""Where the 32 chessmen stand, how far they may move, and positions written as scene vectors.

A file is a letter a to h along +x, a rank 1 to 8 along -z: White sits at +z. Lengths are metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from modelling.textures import hash_noise

SQUARE = 0.055
BOARD_TOP = 0.7785
LIFT = 0.09
"""The highest lift above the board."""

BACK_RANK = ("rook", "knight", "bishop", "queen", "king", "bishop", "knight", "rook")

OFFICER = {"side": 0.008, "back": 0.008, "forward": 0.014}
PAWN = {"side": 0.012, "back": 0.006, "forward": 2 * SQUARE}
"""Ranges in metres. Neighbours never touch: 55 mm > 14 + 6 + the radii 18.5 and 14.5 between an
officer and the pawn before it, 55 > 2 * 8 + 2 * 18.5 between officers, 55 > 2 * 12 + 2 * 14.5
between pawns, also between white and black ones, which end on the fourth and the fifth rank."""


@dataclass(frozen=True)
class Man:
    """One of the 32: its colour ("white", "black"), kind, file (0 to 7) and rank (1 to 8)."""

    colour: str
    kind: str
    file: int
    rank: int

    @property
    def name(self) -> str:
        return f"{self.colour}_{self.kind}_{'abcdefgh'[self.file]}"

    @property
    def forward(self) -> int:
        """The direction along z in which it advances."""
        return -1 if self.colour == "white" else 1

    @property
    def place(self) -> tuple[float, float]:
        """Where it stands in the opening position: x, z."""
        return (self.file - 3.5) * SQUARE, (4.5 - self.rank) * SQUARE

    @property
    def ranges(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest offset in x, y and z."""
        room = PAWN if self.kind == "pawn" else OFFICER
        ends = sorted((-room["back"] * self.forward, room["forward"] * self.forward))
        return (
            np.array([-room["side"], 0, ends[0]]),
            np.array([room["side"], LIFT, ends[1]]),
        )


def men() -> list[Man]:
    officers = [(colour, rank) for colour, rank in (("white", 1), ("black", 8))]
    army = []
    for colour, rank in officers:
        army += [Man(colour, kind, file, rank) for file, kind in enumerate(BACK_RANK)]
        pawns = 2 if rank == 1 else 7
        army += [Man(colour, "pawn", file, pawns) for file in range(8)]
    return army


@dataclass(frozen=True)
class Position:
    """What differs from the opening position; men are named as "white_pawn_e".

    advanced: how many squares a man has gone forward. lifted: part of the highest lift.
    captured: who is gone. untidy: how far men stand off their squares' middles, 0 to 1; seed: in
    which directions.
    """

    advanced: dict[str, float]
    lifted: dict[str, float]
    captured: tuple[str, ...] = ()
    untidy: float = 0.3
    seed: int = 0

    def scene_vector(self) -> list[float]:
        """The vector v [128], two decimals each: x, y, z and presence of every man."""
        vector: list[float] = []
        for number, man in enumerate(men()):
            low, high = man.ranges
            chance = hash_noise(np.array([2 * number, 2 * number + 1]), np.full(2, self.seed))
            shift = self.untidy * (2 * chance - 1)
            z = self.advanced.get(man.name, 0.0) * SQUARE * man.forward + 0.006 * shift[1]
            offset = np.array([high[0] * shift[0], self.lifted.get(man.name, 0.0) * LIFT, z])
            part = np.clip((offset - low) / (high - low), 0, 1)
            vector += [round(float(p), 2) for p in part]
            vector.append(0.0 if man.name in self.captured else 1.0)
        return vector
