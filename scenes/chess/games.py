"""Positions of the chess scene: test frames and the key frames of its path."""

from __future__ import annotations

from position import Man, Position, men

WHITE_LOST = ("white_pawn_d", "white_bishop_f", "white_pawn_b")
BLACK_LOST = ("black_pawn_c", "black_knight_g", "black_pawn_f", "black_bishop_c")


def named(colour: str = "", kind: str = "") -> list[str]:
    """The men of a colour, a kind, or both."""
    return [m.name for m in men() if colour in ("", m.colour) and kind in ("", m.kind)]


def all_but(*kept: str) -> tuple[str, ...]:
    """Everyone except those named, and except the kings."""
    return tuple(name for name in named() if name not in kept and "king" not in name)


def wave(man: Man) -> float:
    """A lift that grows from one corner of the board to the other."""
    return (man.file + man.rank - 1) / 14


def opening() -> Position:
    return Position({}, {})


def kings_gambit() -> Position:
    advanced = {"white_pawn_e": 2.0, "black_pawn_e": 2.0, "white_pawn_f": 2.0}
    return Position(advanced, {"black_knight_g": 0.8}, seed=1)


def hand_over_board() -> Position:
    """The white queen in the air, as if held."""
    advanced = {"white_pawn_d": 2.0, "black_pawn_d": 2.0, "white_pawn_c": 1.0, "black_pawn_e": 1.0}
    return Position(advanced, {"white_queen_d": 1.0}, ("black_pawn_g",), seed=2)


def middle_game() -> Position:
    advanced = {"white_pawn_e": 2.0, "white_pawn_a": 1.0, "white_pawn_h": 2.0, "white_pawn_c": 1.0}
    advanced |= {"black_pawn_e": 1.0, "black_pawn_b": 1.0, "black_pawn_h": 2.0, "black_pawn_a": 1.0}
    return Position(advanced, {}, WHITE_LOST + BLACK_LOST, seed=3)


def exchange() -> Position:
    """Two men in the air at once."""
    position = middle_game()
    lifted = {"white_knight_b": 0.7, "black_queen_d": 1.0, "white_pawn_e": 0.4}
    return Position(position.advanced, lifted, position.captured, seed=4)


def end_game() -> Position:
    kept = ("white_rook_a", "black_rook_h", "white_pawn_c", "white_pawn_g", "black_pawn_b")
    kept += ("black_pawn_f", "white_bishop_c")
    advanced = {"white_pawn_c": 2.0, "black_pawn_b": 1.0, "black_pawn_f": 2.0, "white_pawn_g": 1.0}
    return Position(advanced, {}, all_but(*kept), untidy=0.7, seed=5)


def two_kings() -> Position:
    """Bare kings, the white one lifted: long shadows on an empty board."""
    return Position({}, {"white_king_e": 0.6}, all_but(), seed=6)


def all_lifted() -> Position:
    """Everyone at full height: no contact shadows."""
    return Position({}, dict.fromkeys(named(), 1.0), seed=7)


def lifted_in_a_wave() -> Position:
    return Position({}, {m.name: wave(m) for m in men()}, seed=8)


def pawns_met() -> Position:
    """All pawns advanced to the middle, where they stand closest."""
    return Position(dict.fromkeys(named(kind="pawn"), 2.0), {}, untidy=0.9, seed=9)


def white_alone() -> Position:
    """All black men captured, the white officers half lifted."""
    lifted = {name: 0.5 for name in named("white") if "pawn" not in name}
    return Position({}, lifted, tuple(named("black")), seed=10)


def untidy_opening() -> Position:
    return Position({}, {}, untidy=1.0, seed=11)


HARD_FRAMES = (
    opening,
    hand_over_board,
    middle_game,
    exchange,
    end_game,
    two_kings,
    all_lifted,
    lifted_in_a_wave,
    pawns_met,
    white_alone,
)
CAMERA_PATH = (
    opening,
    kings_gambit,
    hand_over_board,
    middle_game,
    exchange,
    end_game,
    two_kings,
    lifted_in_a_wave,
    untidy_opening,
)
