"""What tracks that were similar before did next: a model of the motion at a place, learned from the observed past.

People follow each other around a corner, and cars follow the lanes of a roundabout. Positions of all tracks, at
multiples of one spacing, are searched for motions that began near the present one with nearly its velocity.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import isnan
from typing import NamedTuple
from weakref import ref

import numpy as np

from slalom import kernels
from slalom.checks import Array
from slalom.kernels.arrays import Indices, TrackSamples
from slalom.tolerances import SIMILAR_BLOCK, SIMILAR_MEMORY, SIMILAR_VELOCITY_SPAN
from slalom.trajectory import Trajectory

Trajectories = tuple[Trajectory, ...]


class SimilarMotions:
    """The motions of `tracks` up to a time, sampled at multiples of `spacing` [s].

    Nothing that comes later has an effect, and the same time always gives the same result.

    Attributes:
        tracks: at least one, all of one dimension. count: largest number of similar motions that count.
        step: number of the last sample.
    """

    def __init__(self, tracks: Sequence[Trajectory], spacing: float, now: float, count: int) -> None:
        self.tracks: Trajectories = tuple(tracks)
        self.spacing, self.count = spacing, count
        self.step = int(np.floor(now / spacing))
        self.step -= self.step * spacing > now

    def displacements(self, places: Array, velocities: Array, times: Indices) -> Array:
        """Displacements (n, k, d + 2) from `places` (n, d) [m] after `times` (k,), see `similar_displacements`.

        velocities: (n, d) [m per spacing]. times: [spacings] whole, from 0 on.
        """
        samples = _sampled(self.tracks, self.spacing, self.step).until(self.step)
        return kernels.similar_displacements(places, velocities, times, samples, self.count)

    def past_errors(self, tracks: Sequence[Trajectory], lead: int, checks: Sequence[int]) -> list[list[float]]:
        """Errors [m] of predictions over `lead` spacings of each track, that were due `checks` [spacings] ago.

        The predictions are those of that time. A track that did not exist then has fewer errors.
        """
        numbers = {id(track): k for k, track in enumerate(self.tracks)}
        some = [numbers[id(track)] for track in tracks if id(track) in numbers]
        sampled = _sampled(self.tracks, self.spacing, self.step)
        places, errors = sampled.positions[np.searchsorted(sampled.rows, some)], []
        for ago in checks:
            moment = _Moment(self.tracks, self.spacing, self.step - ago - lead, ref(sampled))
            expected = _expected(moment, lead, self.count)
            errors.append(np.linalg.norm(expected[some] - places[:, -1 - ago], axis=1))
        each = dict(zip(some, np.array(errors).T.tolist()))
        return [[e for e in each.get(numbers.get(id(track), -1), []) if not isnan(e)] for track in tracks]


def rounded(spacing: float) -> float:
    """A spacing [s] with three digits: that of a sensor varies, and other multiples need other samples."""
    return round(spacing, 2 - int(np.floor(np.log10(spacing))))


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Samples of tracks up to a step, of more steps than are searched: they serve earlier steps too."""

    rows: Indices  # (r,) the tracks that exist then
    positions: Array  # (r, k, d) [m] nan where a track does not exist
    first: Indices  # (r,) the first column of each
    last: Indices  # (r,) its last column
    longest: Array  # (r,) [m] the longest way of each in one spacing
    step: int  # of the last column

    def until(self, step: int) -> TrackSamples:
        """The samples of the last SIMILAR_MEMORY steps up to `step`."""
        column = self.positions.shape[1] - 1 - (self.step - step)
        first, last = np.maximum(self.first, column - SIMILAR_MEMORY), np.minimum(self.last, column)
        return TrackSamples(self.positions, first, last, self.longest)


@dataclass(frozen=True)
class _Moment:
    """A step of tracks. What is known at it does not depend on how much later the samples end.

    Moments are keys of a cache, which would keep the samples without a weak reference.
    """

    tracks: Trajectories
    spacing: float
    step: int
    sampled: "ref[_Sampled]" = field(compare=False)


@lru_cache(maxsize=64)
def _expected(at: _Moment, lead: int, count: int) -> Array:
    """Positions (n, d) [m] that were expected at a step for `lead` spacings later; nan for tracks that were not."""
    sampled, span = at.sampled(), SIMILAR_VELOCITY_SPAN
    assert sampled is not None
    samples, newest = sampled.until(at.step), sampled.positions.shape[1] - 1 - (sampled.step - at.step)
    there = np.flatnonzero((samples.last == newest) & (samples.first <= newest - span))
    places, before = samples.positions[there, newest], samples.positions[there, newest - span]
    moved = kernels.similar_displacements(places, (places - before) / span, np.array([lead]), samples, count)
    found = np.full((len(at.tracks), at.tracks[0].dimension), np.nan)
    found[sampled.rows[there]] = places + moved[:, 0, :-2]
    return found


class _Block(NamedTuple):
    """Positions at consecutive steps."""

    rows: Indices  # (r,) the tracks that exist then
    positions: Array  # (r, k, d) [m] nan where a track does not exist


@lru_cache(maxsize=4)
def _sampled(tracks: Trajectories, spacing: float, step: int) -> _Sampled:
    """The samples up to `step`, of whole blocks before it."""
    numbers = range((step - SIMILAR_MEMORY) // SIMILAR_BLOCK - 1, (step + 1) // SIMILAR_BLOCK)
    blocks = [_whole_block(tracks, spacing, number) for number in numbers]
    blocks.append(_block(tracks, spacing, numbers.stop * SIMILAR_BLOCK, step + 1))
    rows, column = np.unique(np.concatenate([block.rows for block in blocks])), 0
    columns = sum(block.positions.shape[1] for block in blocks)
    positions = np.full((len(rows), columns, tracks[0].dimension), np.nan)
    for block in blocks:
        end = column + block.positions.shape[1]
        positions[np.searchsorted(rows, block.rows), column:end] = block.positions
        column = end
    there = ~np.isnan(positions[..., 0])
    first, last = there.argmax(axis=1), columns - 1 - there[:, ::-1].argmax(axis=1)
    ways = np.nan_to_num(np.linalg.norm(np.diff(positions, axis=1), axis=2))
    return _Sampled(rows, positions, first, last, ways.max(axis=1), step)


@lru_cache(maxsize=64)
def _whole_block(tracks: Trajectories, spacing: float, number: int) -> _Block:
    return _block(tracks, spacing, number * SIMILAR_BLOCK, (number + 1) * SIMILAR_BLOCK)


def _block(tracks: Trajectories, spacing: float, begin: int, end: int) -> _Block:
    """The tracks at the steps from `begin` to `end`."""
    times, spans = spacing * np.arange(begin, end), _spans(tracks)
    firsts, lasts = np.searchsorted(times, spans[:, 0]), np.searchsorted(times, spans[:, 1], side="right")
    rows = np.flatnonzero(firsts < lasts)
    positions = np.full((len(rows), len(times), tracks[0].dimension), np.nan)
    for row, k in enumerate(rows.tolist()):
        positions[row, firsts[k] : lasts[k]] = tracks[k].position(times[firsts[k] : lasts[k]])
    return _Block(rows, positions)


@lru_cache(maxsize=8)
def _spans(tracks: Trajectories) -> Array:
    """First and last time (n, 2) [s] of each track."""
    return np.array([track.span for track in tracks])
