"""Views inside the tabs of a viewer."""

from typing import Any


def views_of(blueprint: dict[str, Any], tab: str) -> set[str]:
    """Identities of the views in a tab, however deep."""
    containers = {path.strip("/"): fields.get("ContainerBlueprint", {}) for path, fields in blueprint.items()}
    (start,) = (path for path, fields in containers.items() if fields.get("display_name") == tab)
    found, left = set(), [start]
    while left:
        for one in containers[left.pop()].get("contents", []):
            if one.startswith("view/"):
                found.add(one.removeprefix("view/"))
            else:
                left.append(one)
    return found
