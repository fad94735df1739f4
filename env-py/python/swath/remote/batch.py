"""Many environments on servers, with the methods of a batch in this process."""

from __future__ import annotations

import atexit
import os
import secrets
import threading
import time
import warnings
import weakref
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from swath import _native
from swath.errors import ClosedError, ConfigError, RemoteError, RemoteTimeout
from swath.evaluation.study import whole
from swath.options import bytes_of, flag
from swath.remote.link import Link
from swath.remote.session import endpoints_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import Any, TypeAlias

    import numpy as np
    import numpy.typing as npt

    from swath.remote.link import Answers
    from swath.spaces import Bound, Part

__all__ = ["RemoteBatch"]

_MOST_HASH_EVERY = 2**32 - 1
# Between two looks at servers of which some lag behind: the longer nothing has come, the longer.
_SHORTEST_LOOK_S, _LONGEST_LOOK_S = 50e-6, 2e-3
# How long ended sessions may take to be told, of one batch and at the end of the process of all together.
_CLOSE_S = 1.0
# So many names of servers are told where one is asked for that is not there.
_MOST_NAMES = 8

_open_batches: weakref.WeakSet[RemoteBatch] = weakref.WeakSet()

Step: TypeAlias = "tuple[Any, npt.NDArray[np.float64], npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, object]]"
FlatStep: TypeAlias = "tuple[Any, npt.NDArray[np.float32], npt.NDArray[np.bool_], list[dict[str, object]], list[int]]"


class RemoteBatch:
    """A batch whose rows lie on one server or several, some neighbouring ones on each.

    Each server is asked at the same time. What got lost on the way is asked again, and is done once.
    """

    def __init__(
        self,
        scenario: _native.Scenario,
        num_envs: int,
        autoreset_mode: str,
        connect: str | Sequence[str],
        *,
        server: str = "default",
        copy: bool = True,
        percept: bool = False,
        infos: bool = True,
        attempt_s: float = 2.0,
        deadline_s: float = 60.0,
        client: str = "",
        resume: bool = False,
        hash_every: int = 64,
        zenoh: dict[str, object] | None = None,
    ) -> None:
        """Opens a session on every server; with `percept` each tells what its mowers perceive, for scripted agents.

        Raises:
            ConfigError: If an argument cannot be used.
            RemoteError: If a server cannot be reached, has another version of swath, or takes no further session.
            ResumeError: If it is to be resumed and a server sends no snapshots.
        """
        endpoints = endpoints_of(connect)
        if not 1 <= len(endpoints) <= num_envs:
            some = "1 server for 1 environment"
            if num_envs > 1:
                some = f"from 1 to {num_envs} servers, no more than environments"
            text = f"`connect` must name {some}, got {connect!r}"
            raise ConfigError(text)
        if not isinstance(client, str):
            text = f"`client` must be at most 64 printable characters, got {client!r}"
            raise ConfigError(text)
        infos, copy, resume = flag("infos", infos), flag("copy", copy), flag("resume", resume)
        if percept and not infos:
            text = "`infos` must be True with `percept`: mowed weeds are counted from the reward, got False"
            raise ConfigError(text)
        share, rest = divmod(num_envs, len(endpoints))
        rows = [share + (part < rest) for part in range(len(endpoints))]
        self._start_s = time.monotonic()
        attempt_ms = _ms("attempt_s", attempt_s)
        self._core = _native.RemoteBatch(
            scenario,
            rows,
            autoreset_mode,
            copy=copy,
            infos=infos,
            patience_ms=(attempt_ms, _ms("deadline_s", deadline_s)),
            jitter_seed=secrets.randbits(64),
            hash_every=whole("hash_every", hash_every, least=1, most=_MOST_HASH_EVERY) if resume else None,
        )
        # Nobody has been told yet that it no longer can.
        self._can_resume = resume
        # Who was interrupted on the way to its turn, or from it, can take it again.
        self._turn = threading.RLock()
        self._links: list[Link] = []
        # What was asked last of each server, if more answers may come.
        self._asked: dict[int, Answers] = {}
        # What each server answered last: were it freed together with the arrays made of it, the system would take the
        # memory back, and to get it anew at every step takes long.
        self._last_replies: dict[int, bytes] = {}
        self._finish: Callable[[], Any] = self._core.finish_open
        # Servers of which nothing has come since they were asked last.
        self._silent: set[int] = set()
        self._is_open = False
        self._pid = os.getpid()
        try:
            self._links += [Link(endpoint, server, attempt_ms / 1000, zenoh) for endpoint in endpoints]
            self._check_names()
            nonces = [secrets.randbits(128) for _ in endpoints]
            self._call(self._core.begin_spec, self._core.finish_spec)
            self._call(lambda now_ms: self._core.begin_open(now_ms, nonces, client, percept), self._core.finish_open)
            for part, link in enumerate(self._links):
                link.use_low_latency(self._core.max_reply(part))
        except BaseException:
            self.close()
            raise
        self._is_open = True
        _open_batches.add(self)

    @property
    def native(self) -> _native.RemoteBatch:
        """What a `Crew` acts on."""
        return self._core

    @property
    def scenario(self) -> _native.Scenario:
        """The scenario with every key resolved."""
        return self._core.scenario

    @property
    def observation_spec(self) -> list[Part]:
        """The parts of an observation of one environment."""
        return self._core.observation_spec

    @property
    def action_spec(self) -> list[Bound] | int:
        """What an action is."""
        return self._core.action_spec

    @property
    def has_begun(self) -> bool:
        """Whether every row has begun an episode."""
        return self._core.has_begun

    @property
    def action_masks(self) -> npt.NDArray[np.bool_]:
        """Which choices are open; an `AttributeError` where actions are no choices."""
        return self._core.action_masks

    @property
    def has_low_latency(self) -> bool:
        """Whether the next step goes by the connection for low latency, on every server."""
        return all(link.has_low_latency for link in self._links)

    @property
    def resumed(self) -> int:
        """How often a session was resumed at a server that was started anew."""
        return self._core.resumed

    def reset(
        self,
        seeds: Sequence[int | None],
        mask: npt.NDArray[np.bool_] | None = None,
        weeds: Sequence[object] = (),
        first_seed: int | None = None,
    ) -> tuple[Any, dict[str, object]]:
        """Begins episodes, as the native batch does."""
        result: tuple[Any, dict[str, object]] = self._call(
            lambda now_ms: self._core.begin_reset(now_ms, seeds, mask, list(weeds), first_seed), self._core.finish_reset
        )
        return result

    def step(self, actions: object) -> Step:
        """Steps every row, as Gymnasium wants it."""
        result: Step = self._call(lambda now_ms: self._core.begin_step(now_ms, actions), self._core.finish_step)
        return result

    def step_alone(self, action: object) -> Step:
        """Steps the only row, whose action stands by itself."""
        result: Step = self._call(lambda now_ms: self._core.begin_step_alone(now_ms, action), self._core.finish_step)
        return result

    def step_flat(self, actions: object, elapsed_s: float) -> FlatStep:
        """Steps every row, as stable-baselines3 wants it."""
        result: FlatStep = self._call(
            lambda now_ms: self._core.begin_step(now_ms, actions), lambda: self._core.finish_step_flat(elapsed_s)
        )
        return result

    def summary(self, row: int) -> dict[str, float]:
        """Returns the numbers of a row's present episode, as the native batch does; it takes percepts."""
        return self._core.summary(row)

    def snapshot(self, row: int | None = None) -> bytes:
        """Returns the state as bytes: of all rows, or of one."""
        snapshot: bytes = self._call(
            lambda now_ms: self._core.begin_snapshot(now_ms, row), lambda: self._core.finish_snapshot(row)
        )
        return snapshot

    def restore(self, snapshot: bytes, row: int | None = None) -> None:
        """Puts back what `snapshot` returned."""
        checked = bytes_of(snapshot)
        self._call(lambda now_ms: self._core.begin_restore(now_ms, checked, row), self._core.finish_restore)

    def retry(self) -> object:
        """Asks once more for what was not answered in time, and returns what that call would have returned.

        Raises:
            RemoteTimeout: If it is not answered this time either.
            ResumeError: If the session was lost and is not resumed.
            RemoteError: If every call was answered.
        """
        return self._call(self._core.retry, self._finish)

    def close(self, most_s: float = _CLOSE_S) -> None:
        """Ends the sessions; a server that does not answer within so many seconds is left alone.

        Raises:
            RemoteError: If another thread is in a call.
        """
        with self._turn_of_this_thread():
            if not self._links:
                return
            _open_batches.discard(self)
            try:
                self._call(self._core.begin_close, self._core.finish_close, most_s=most_s)
            except Exception:
                pass
            finally:
                self._leave()

    def __reduce__(self) -> str:
        """Refuses to be pickled, and so does whatever holds it."""
        text = "an environment on a server cannot be pickled: make it where it is used, or take a `snapshot`"
        raise TypeError(text)

    def _leave(self) -> None:
        links, self._links = self._links, []
        self._asked.clear()
        self._last_replies.clear()
        for link in links:
            link.close()

    def _now_ms(self) -> int:
        return int(1000 * (time.monotonic() - self._start_s))

    def _call(self, begin: Callable[[int], None], finish: Callable[[], Any], *, most_s: float = float("inf")) -> Any:  # noqa: ANN401
        """Begins a call, moves messages until every server has answered or is given up, and returns what it brought."""
        with self._turn_of_this_thread():
            return self._call_alone(begin, finish, most_s)

    @contextmanager
    def _turn_of_this_thread(self) -> Iterator[None]:
        if not self._turn.acquire(blocking=False):
            text = "another call is in flight: an environment is for one thread at a time"
            raise RemoteError(text)
        try:
            yield
        finally:
            self._turn.release()

    def _call_alone(self, begin: Callable[[int], None], finish: Callable[[], Any], most_s: float) -> Any:  # noqa: ANN401
        for number, link in enumerate(self._links):
            if most_s == float("inf"):
                link.look_for_low_latency_again()
            # Another answer to the last question, of a server that should not be there.
            self._take_in_late(number)
        try:
            begin(self._now_ms())
            self._finish = finish
            self._move_messages(time.monotonic() + most_s)
        except BaseException:
            # Interrupted, or half begun: what is in flight can be settled by `retry`, `reset` or `close`.
            self._core.abandon(self._now_ms())
            raise
        finally:
            self._hold_leases()
        if self._can_resume and self._core.gap is not None:
            self._can_resume = False
            text = f"`resume` holds no longer: a server refused a further snapshot: {self._core.gap}"
            warnings.warn(text, RuntimeWarning, stacklevel=5)
        try:
            return finish()
        except RemoteTimeout as error:
            if most_s < float("inf"):
                raise
            text = f"{error}; {self._why_silent()}"
            raise RemoteTimeout(text) from None
        except RemoteError as error:
            part = self._core.failed()
            if part is None or len(self._links) == 1:
                raise
            text = f"{self._links[part].endpoint}: {error}"
            raise type(error)(text) from None

    def _check_names(self) -> None:
        """Refuses a name where there are servers of other names alone; where there is nobody, one may still come."""
        for link, names in zip(self._links, [link.look_around() for link in self._links], strict=True):
            found = names()
            if found and link.server not in found:
                there = ", ".join(f"`{name}`" for name in found[:_MOST_NAMES])
                text = f"there is no server `{link.server}` at {link.endpoint}, but {there}"
                raise RemoteError(text)

    def _why_silent(self) -> str:
        """Says what may be wrong with servers that have not answered: who is refused by one gets silence."""
        links = [self._links[part] for part in sorted(self._silent)]
        for link, is_there in zip(links, [link.look() for link in links], strict=True):
            if not is_there():
                perhaps = "not running any more, or stopped" if self._is_open else "not running, called otherwise"
                return f"no sign of `{link.server}` at {link.endpoint}: {perhaps}, or we are not authorised"
        return f"the server at {' and '.join(link.endpoint for link in links)} is running"

    def _hold_leases(self) -> None:
        """Shows every server that its client is there; a session that was resumed has another lease."""
        for part, link in enumerate(self._links):
            lease = self._core.lease(part)
            if lease is not None:
                link.hold(lease)

    def _move_messages(self, end_s: float) -> None:
        waiting = set(range(len(self._links)))
        asked: dict[int, Answers] = {}
        # Servers answer the first question at about the same time. Whoever has more to be asked, such as one that was
        # started anew, does not wait for the others after that.
        is_first = True
        moved_s = time.monotonic()
        while waiting and (now_s := time.monotonic()) < end_s:
            wake_s = [end_s]
            if not self._links:
                text = "the environment was closed, by a signal handler perhaps, while a call was in flight"
                raise ClosedError(text)
            for part in sorted(waiting - asked.keys()):
                what, verb, message, number = self._core.poll(part, self._now_ms())
                if what == "send":
                    assert verb is not None, "a message has a verb"
                    assert message is not None, "and bytes"
                    timeout_s = min(number / 1000, end_s - time.monotonic())
                    asked[part] = self._links[part].ask(verb, message, timeout_s)
                    self._silent.add(part)
                elif what == "wait":
                    wake_s.append(self._start_s + number / 1000)
                else:
                    waiting.discard(part)
            is_alone = len(waiting) == 1
            answered = [
                part for part, answers in asked.items() if self._take_in(part, answers, waits=is_first or is_alone)
            ]
            for part in answered:
                del asked[part]
            if answered:
                is_first, moved_s = False, time.monotonic()
            elif waiting:
                if asked:
                    wake_s.append(now_s + min(max(_SHORTEST_LOOK_S, (now_s - moved_s) / 8), _LONGEST_LOOK_S))
                time.sleep(max(0.0, min(wake_s) - time.monotonic()))

    def _take_in(self, part: int, answers: Answers, *, waits: bool) -> bool:
        """Takes in what has come, or waits for all of it. Returns whether there is no more to wait for."""
        for message in answers if waits else answers.arrived():
            if message is None:
                self._core.on_timeout(part, self._now_ms())
                continue
            self._last_replies[part] = message
            if self._core.on_reply(part, self._now_ms(), message):
                self._silent.discard(part)
                # The network says later that there is no other answer, and if there is one, the next call is told.
                self._asked[part] = answers
                return True
        if answers.is_silent and answers.is_over:
            self._core.on_nothing(part, self._now_ms())
        return answers.is_over

    def _take_in_late(self, part: int) -> None:
        answers = self._asked.pop(part, None)
        for message in answers.late() if answers is not None else ():
            self._core.on_reply(part, self._now_ms(), message)


def _close_all() -> None:
    """Tells servers at the end of a process that nobody will come again; a forked child's parent still may."""
    end_s = time.monotonic() + _CLOSE_S
    for batch in list(_open_batches):
        if batch._pid == os.getpid():
            # Whoever is still in a call then is not waited for.
            with suppress(RemoteError):
                batch.close(max(0.0, end_s - time.monotonic()))


atexit.register(_close_all)


def _ms(field: str, seconds: float) -> int:
    if isinstance(seconds, bool) or not (isinstance(seconds, int | float) and 0.001 <= seconds <= 86_400):
        text = f"`{field}` must be from 0.001 to 86400 seconds, got {seconds!r}"
        raise ConfigError(text)
    return round(1000 * seconds)
