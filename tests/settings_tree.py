"""All settings, found by walking the groups."""

from pydantic import BaseModel

from vidtrack.config.settings import Settings


def places(group=Settings, prefix=""):
    """(dotted name, (group, name in it)) of every setting that is not a group."""
    for name, info in group.model_fields.items():
        kind = info.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from places(kind, f"{prefix}{name}.")
        else:
            yield prefix + name, (group, name)
