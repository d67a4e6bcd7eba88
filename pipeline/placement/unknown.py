"""The search for the poses of nodes that have none: colour first, then surfaces, then loops."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

from pipeline.config import RegistrationConfig
from pipeline.kernels import geometry
from pipeline.placement.attempt import Attempt, attempt_found
from pipeline.placement.pairs import (
    COLOUR_TRIES,
    JoiningPairs,
    Pair,
    across_bridges,
    given_pairs,
    likeliest_first,
    lone_tries,
)
from pipeline.placement.samples import NodeSample
from pipeline.placement.views import Views
from pipeline.registration.finding.starts import Start
from pipeline.registration.graph.edges import PoseEdge
from pipeline.registration.graph.loops import best_loops


class UnknownPoses:
    """Tries registrations that join nodes without known poses to other nodes."""

    def __init__(
        self,
        samples: Sequence[NodeSample],
        known: Sequence[bool],
        config: RegistrationConfig,
        views: Views,
        tried: Sequence[Attempt],
    ) -> None:
        """Begin with the attempts from given poses.

        Args:
            samples: the nodes.
            known: whether each node's pose is known.
            config: settings of the registrations.
            views: the nodes' surfaces and features.
            tried: registrations from given poses.
        """
        self._samples, self._known, self._config, self._views = samples, known, config, views
        self._tried = list(tried)
        self._links = self._agreeing()

    def attempts(self) -> list[Attempt]:
        """Return the attempts from given poses, then those of the search.

        First, pairs of nodes that are not joined yet are tried from features of their colour images, the
        likeliest first; then from features of their surfaces. Then nodes with a common view at the poses that
        were found are registered, which closes loops. Where still a single registration joins two groups,
        other pairs are tried from colour features without regard to these poses; where they lead elsewhere,
        the stronger evidence stays.
        """
        views, count = self._views, len(self._samples)
        order = likeliest_first(self._known, views.likeness)
        by_colour = JoiningPairs(order, [COLOUR_TRIES] * count)
        while (pair := by_colour.next(self._links)) is not None:
            self._attempt(pair, views.by_colour(*pair))
        by_surfaces = JoiningPairs(order, lone_tries(count, self._links))
        while (pair := by_surfaces.next(self._links)) is not None:
            self._attempt(pair, views.by_surfaces(*pair))
        self._close_loops()
        done = {attempt.link for attempt in self._tried}
        for pair in across_bridges([pair for pair in order if pair not in done], self._links, count):
            self._attempt(pair, views.by_colour(*pair))
        return self._tried

    def _attempt(self, pair: Pair, start: Start) -> None:
        source, target = pair
        samples = self._samples[source], self._samples[target]
        attempt = attempt_found(*samples, pair, self._config, start, self._views)
        self._tried = [one for one in self._tried if one.link != pair or one.holds] + [attempt]
        if attempt.holds:
            self._links = self._agreeing()

    def _close_loops(self) -> None:
        """Register nodes that have a common view at the poses that were found."""
        loops = best_loops(len(self._samples), self._edges())
        poses = list(loops.T_root_node)
        partners, others = given_pairs(self._samples, poses, loops.root.tolist())
        for pair in sorted({*partners, *others} - {attempt.link for attempt in self._tried if attempt.holds}):
            if self._known[pair[0]] and self._known[pair[1]]:
                continue
            T_target_source = geometry.inverse(poses[pair[1]]) @ poses[pair[0]]
            self._attempt(pair, Start("given", partial(list, [T_target_source])))

    def _edges(self) -> list[PoseEdge]:
        return [attempt.edge for attempt in self._tried if attempt.edge is not None]

    def _agreeing(self) -> list[Pair]:
        """Return the pairs whose registrations agree with the measurements and with each other, and links
        between the nodes with known poses.
        """
        edges = self._edges()
        agreeing = best_loops(len(self._samples), edges).agreeing(len(edges))
        links = [
            (edge.source, edge.target)
            for edge, agrees in zip(edges, agreeing, strict=True)
            if agrees and edge.agrees
        ]
        return links + list(pairwise(index for index, one in enumerate(self._known) if one))
