"""Shares of a sweep for several machines that write to one store."""

from collections.abc import Mapping
from typing import Final, NamedTuple, TypeVar

from slalom.errors import InvalidInput
from slalom.sim.sweep.case import Failure

Item = TypeVar("Item")

OTHER: Final = Failure("of another shard")
"""Result of a run that a shard leaves to others."""
MISSING: Final = Failure("no result in the store: its shard has not finished, or refused it")
"""Result of a run that a merge does not find."""


class Shard(NamedTuple):
    """Share `number` of `of`, from 1."""

    number: int
    of: int

    @classmethod
    def named(cls, text: str) -> "Shard":
        """Return the shard of a text such as 2/8. Raises InvalidInput for any other text."""
        number, slash, count = text.partition("/")
        if not (slash and number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            raise InvalidInput(f"shard: expected K/N with K from 1 to N, found {text!r}")
        return cls(int(number), int(count))

    def part(self, items: Mapping[str, Item]) -> dict[str, Item]:
        """Return the items of this shard: every `of`-th, so that all shards have as many, up to one.

        Together the shards have every item once, as long as the items and their order are the same.
        """
        return {key: item for k, (key, item) in enumerate(items.items()) if k % self.of == self.number - 1}
