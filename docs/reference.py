"""What is made from the code when the site is built: the references, the home page, manuals."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
KINDS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "null": ""}
BOUNDS = {"minimum": "at least", "maximum": "at most", "exclusiveMinimum": "above", "exclusiveMaximum": "below"}


def on_config(config: Any) -> Any:
    """List every record of a decision."""
    inside = config.nav[-1]["Inside"]
    inside[-1] = {
        "Decisions": [f"decisions/{record.name}" for record in sorted((ROOT / "docs/decisions").glob("*.md"))]
    }
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the made pages; links of the README lead into the site."""
    readme = (ROOT / "README.md").read_text("utf-8").replace("](docs/", "](").replace("](CONTRIBUTING.md)", "]()")
    pages = {
        "index.md": readme.replace(" · [contributing]()", ""),
        "reference/python.md": python_page(),
        "reference/commands.md": commands_page(),
        "reference/scene-toml.md": scene_page(),
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def python_page() -> str:
    """The public names of `import lambent`."""
    import lambent

    parts = [f"# Python\n\n{import_module('lambent.api').__doc__}"]
    functions = [one for one in lambent.__all__ if one[0].islower()]
    for name in (*functions, *(one for one in lambent.__all__ if one[0].isupper())):
        parts.append(f"::: {getattr(lambent, name).__module__}.{name}")
    return "\n\n".join(parts) + "\n"


def commands_page() -> str:
    """The help of each command."""
    parts = ["# Commands\n", "`man -M out/man lambent-bake` shows the same where the site was built.\n"]
    parts += [f"## {name}\n\n```text\n{text}\n```\n" for name, text in helps().items()]
    return "\n".join(parts)


def helps() -> dict[str, str]:
    """The help of each command, by name."""
    import typer

    from lambent.cli.main import build_app

    group: Any = typer.main.get_command(build_app())
    how = {"max_content_width": 80, "terminal_width": 80}
    return {
        name: command.get_help(typer.Context(command, info_name=f"lambent {name}", **how))
        for name, command in sorted(group.commands.items())
    }


def on_post_build(config: Any) -> None:
    """Write the manuals, man/man1/lambent-NAME.1 beside the site."""
    folder = Path(config.site_dir).parent / "man" / "man1"
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in helps().items():
        lines = text.replace("\\", "\\e").replace("-", "\\-").splitlines()
        guarded = "\n".join("\\&" + line for line in lines)  # no line of the help is a request
        head = f'.TH LAMBENT\\-{name.upper()} 1 "" Lambent\n.SH NAME\nlambent\\-{name}\n.SH DESCRIPTION\n.nf\n'
        (folder / f"lambent-{name}.1").write_text(f"{head}{guarded}\n.fi\n", "utf-8")


def scene_page() -> str:
    """The keys of a scene.toml, of each table, with types, ranges and defaults."""
    from lambent.scenes.loaders.scene_toml.schema import SceneDocument

    schema = SceneDocument.model_json_schema()
    parts = ["# scene.toml\n", "How to use them: [scenes](../scenes.md).\n", *_table("A scene", schema)]
    for name, section in sorted(schema["$defs"].items()):
        if "properties" in section:
            parts += _table(name.removesuffix("Section"), section)
    return "\n".join(parts)


def _table(title: str, section: dict[str, Any]) -> Iterator[str]:
    yield f"## {title}\n\n{section.get('description', '')}\n"
    yield "| key | value | default |\n|---|---|---|"
    needed = section.get("required", [])
    for key, value in section["properties"].items():
        default = "**required**" if key in needed else _plain(value.get("default"))
        yield f"| `{key}` | {_kind(value)} | {default} |"
    yield ""


def _plain(value: object) -> str:
    return "" if value in (None, {}, [], ()) else f"`{value}`"


def _kind(value: dict[str, Any]) -> str:
    """The type of a value in words."""
    if "anyOf" in value or "oneOf" in value:
        kinds = dict.fromkeys(map(_kind, value.get("anyOf", value.get("oneOf", []))))
        return " or ".join(kind for kind in kinds if kind)
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2].removesuffix("Section")
        return f"[{name}](#{name.lower()})"
    if "enum" in value or "const" in value:
        return ", ".join(f"`{one}`" for one in value.get("enum", [value.get("const")]))
    if value.get("type") == "array":
        inside = value.get("prefixItems")
        return f"{len(inside)} numbers" if inside else f"list of {_kind(value.get('items', {}))}"
    if value.get("type") == "object":
        of = value.get("additionalProperties")
        return f"table of {_kind(of)}" if isinstance(of, dict) and of else "table"
    limits = [f"{word} {value[key]:g}" for key, word in BOUNDS.items() if key in value]
    return ", ".join([KINDS.get(value.get("type", ""), "any value"), *limits])
