"""Where the project lies, and how tests write a scene file."""

from pathlib import Path

ROOT = Path(__file__).parents[1]


def write_toml(path: Path, scene: dict) -> Path:
    """Write sections of numbers, strings and lists; enough TOML for scenes."""
    lines = []
    for section, fields in scene.items():
        lines.append(f"[{section}]")
        lines.extend(f"{key} = {_toml(value)}" for key, value in fields.items())
    path.write_text("\n".join(lines) + "\n")
    return path


def _toml(value: object) -> str:
    if isinstance(value, str | Path):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else repr(value)
