"""States of networks of rods by shooting: Kirchhoff's equations with rotation matrices, and balances by hand.

Nothing of contin is used: members are integrated with SciPy's DOP853, all ends meet by Newton's method with differences. The
start is a state that was found otherwise, and must be where Newton's method ends; so are those of all shipped scenes
(tests/branches/test_network.py).
"""

import dataclasses
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ribbon_model.ends import CLAMPED, FREE, HINGED, prescribed
from ribbon_model.network import BALL, FINISH, HINGE, START, Network
from ribbon_model.outlines import fans

#: Steps of differences, and where Newton's method ends.
_STEP, _ENOUGH = 1e-6, 1e-11


def _frame(q) -> np.ndarray:
    """Columns are directors; the quaternion has its scalar first."""
    w, x, y, z = q
    return Rotation.from_quat([x, y, z, w]).as_matrix()


@dataclasses.dataclass
class End:
    """An end of a member: frame (columns are directors), place, force and moment of the rest of the network on it."""

    frame: np.ndarray
    place: np.ndarray
    force: np.ndarray
    moment: np.ndarray


class Shooting:
    """A network whose members are integrated from their beginnings: frame, place, force and moment there are unknown."""

    def __init__(self, network: Network, numbers: dict[str, float]):
        self.network, self.numbers, self.order = network, numbers, list(network.members)

    def number(self, section: str, name: str) -> float:
        full = name if len(self.network.sections) == 1 else f"{name}_{section}"
        return self.numbers.get(full, self.network.sections[section].numbers.get(name, 0.0))

    def integrated(self, name: str, start: End) -> tuple[End, float]:
        """The far end of a member, and its energy."""
        member, net = self.network.members[name], self.network
        stiffness = [self.number(member.section, key) for key in ("B1", "B2", "C")]
        natural = [self.number(member.section, key) for key in ("kappa_n", "kappa_2", "tau_n")]
        names = ("pressure", "weight", "field", "follower_pressure")
        pressure, weight, field, follower = (self.numbers.get(key, 0.0) for key in names)
        side, centre = fans(net)[0][name] if pressure else (0, np.zeros(3))
        normal, down, along = (np.array(v) for v in (net.pressure_normal, net.weight_direction, net.field_direction))

        def rates(s, y):
            R, force, moment = y[:9].reshape(3, 3), y[12:15], y[15:18]
            change = (R.T @ moment) / stiffness
            u1, u2, u3 = change + natural
            turning = np.array([[0, -u3, u2], [u3, 0, -u1], [-u2, u1, 0]])
            d3, magnet = R[:, 2], R[:, net.magnetized]
            load = weight * down - side * pressure * np.cross(d3, normal) - follower * R[:, 1]
            energy = (
                change @ (stiffness * change) / 2
                if math.isfinite(stiffness[1])
                else (change[0] ** 2 * stiffness[0] + change[2] ** 2 * stiffness[2]) / 2
            )
            energy += (
                side * pressure * normal @ np.cross(y[9:12] - centre, d3) / 2 - weight * down @ y[9:12] - field * magnet @ along
            )
            couple = -np.cross(d3, force) - field * np.cross(magnet, along)
            return np.concatenate([(R @ turning).ravel(), d3, -load, couple, [energy]])

        y = np.concatenate([start.frame.ravel(), start.place, -start.force, -start.moment, [0.0]])
        y = solve_ivp(rates, (0, member.length), y, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        return End(y[:9].reshape(3, 3), y[9:12], y[12:15], y[15:18]), float(y[18])

    def ends(self, name: str, unknowns: np.ndarray, base: np.ndarray) -> tuple[End, End, float]:
        frame = base @ Rotation.from_rotvec(unknowns[:3]).as_matrix()
        start = End(frame, unknowns[3:6], -unknowns[6:9], -unknowns[9:12])
        finish, energy = self.integrated(name, start)
        return start, finish, energy

    # --- what vanishes ------------------------------------------------------------------------------------------------

    def missed(self, both: list[tuple[End, End, float]]) -> np.ndarray:
        """All conditions: joints, balances, supports, free ends, and a network that floats."""
        net, found, joined = self.network, [], set()
        for name, joint in net.joints.items():
            ends, frames, places = [], [], []
            for each in joint.members:
                end = both[self.order.index(each.member)][0 if each.end == START else 1]
                angle = self.numbers.get(each.angle, 0.0) if isinstance(each.angle, str) else each.angle
                turned = Rotation.from_rotvec(-angle * np.array(each.axis)).as_matrix()
                frames.append(end.frame @ _frame(net.drawn(each)[:4]).T @ turned)
                places.append(end.place + end.frame @ each.arm)
                ends.append(end)
                joined.add((each.member, each.end))
            origin = places[0]
            force = sum(end.force for end in ends)
            moment = sum(end.moment + np.cross(end.place - origin, end.force) for end in ends)
            moments = [end.moment + np.cross(end.place - place, end.force) for end, place in zip(ends, places)]
            for k in range(1, len(ends)):
                found.append(places[k] - origin)
                kind = joint.kind if not joint.members[k].goes_on else "rigid"
                first = frames[0] if not joint.members[k].goes_on else frames[k - 1]
                apart = Rotation.from_matrix(first.T @ frames[k]).as_rotvec()
                if kind == HINGE:
                    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
                    across = np.linalg.svd(axis[None])[2][1:]
                    goes_on = k + 1 < len(ends) and joint.members[k + 1].goes_on
                    own = moments[k] + moments[k + 1] if goes_on else moments[k]
                    found += [across @ apart, [(frames[0] @ axis) @ own]]
                elif kind == BALL:
                    found.append(moments[k])
                else:
                    found.append(apart)
            for number, given in net.loads.items():
                turned = ends[0].frame @ _frame(net.drawn(joint.members[0])[:4]).T
                for where, direction, arm in given.followers:
                    if where == name:
                        pull = turned @ direction * self.numbers[number]
                        force, moment = force - pull, moment - np.cross(turned @ arm, pull)
                for where, direction, arm in given.forces:
                    if where == name:
                        force = force - self.numbers[number] * np.array(direction)
                        moment = moment - np.cross(frames[0] @ arm, self.numbers[number] * np.array(direction))
            found += self._supported(name, frames[0], origin, force, moment)
        for number, name in enumerate(self.order):
            for end, which in ((START, 0), (FINISH, 1)):
                if (name, end) not in joined:
                    found += [both[number][which].force, both[number][which].moment]
        return np.concatenate([np.ravel(part) for part in found])

    def _supported(self, name: str, frame, place, force, moment) -> list:
        """The balance of a joint, as far as nothing holds it; what holds it; a network that floats is held as it is."""
        net = self.network
        if name not in net.held:
            floats = net.floats and name == next(iter(net.joints))
            return (
                [place - self.held[0], Rotation.from_matrix(self.held[1].T @ frame).as_rotvec()] if floats else [force, moment]
            )
        end, drawn = net.held[name], net.drawn(net.joints[name].members[0])
        moves = np.array([self.numbers.get(f"{name}_{x}", 0.0) for x in ("dx", "dy", "dz")])
        turns = prescribed(*(self.numbers.get(f"{name}_{x}", 0.0) for x in ("turn", "bend", "swing")))
        along = np.array(end.held).reshape(-1, 3)
        free = np.linalg.svd(along)[2][len(along) :] if len(along) else np.eye(3)
        found = [along @ (place - drawn[4:] - moves), free @ force]
        turned = Rotation.from_matrix(_frame(turns).T @ frame).as_rotvec()
        if end.rotation == CLAMPED:
            return [*found, turned]
        if end.rotation == FREE:
            return [*found, moment]
        assert end.rotation == HINGED
        axis = np.array(end.axis)
        for number, given in net.loads.items():
            moment = moment - sum(factor * self.numbers[number] for where, factor in given.moments if where == name) * axis
        return [*found, np.linalg.svd(axis[None])[2][1:] @ turned, [axis @ moment]]

    def begun(self, states: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray, list[tuple[End, End, float]]]:
        """Frames, unknowns (members, 12) and ends for states (14,) of the beginnings; a network that floats is held so."""
        bases = [_frame(state[:4]) for state in states]
        fan, forces = self.numbers.get("pressure", 0.0) * np.array(self.network.pressure_normal) / 2, []
        for name, state in zip(self.order, states):  # n of the multiplier of the centreline
            side, centre = fans(self.network)[0][name] if fan.any() else (0, np.zeros(3))
            forces.append(state[11:14] + side * np.cross(state[4:7] - centre, fan))
        starts = [[0, 0, 0, *state[4:7], *n, *self._moment(state)] for state, n in zip(states, forces)]
        x = np.array(starts, dtype=float)
        both = [self.ends(*given) for given in zip(self.order, x, bases)]
        if self.network.floats:
            each = next(iter(self.network.joints.values())).members[0]
            end = both[self.order.index(each.member)][0 if each.end == START else 1]
            self.held = end.place + end.frame @ each.arm, end.frame @ _frame(self.network.drawn(each)[:4]).T
        return bases, x, both

    def slopes(self, bases: list[np.ndarray], x: np.ndarray, step: float, missed: np.ndarray | None = None) -> np.ndarray:
        """Derivatives of what vanishes: differences to what is ``missed`` at x, or central ones without that."""
        both, columns = [self.ends(*given) for given in zip(self.order, x, bases)], []
        for member, name in enumerate(self.order):
            for i in range(12):
                moved = np.repeat(x[member][None], 2, axis=0)
                moved[:, i] += (step, -step)
                found = []
                for unknowns in moved[: 1 if missed is not None else 2]:
                    other = [*both]
                    other[member] = self.ends(name, unknowns, bases[member])
                    found.append(self.missed(other))
                columns.append((found[0] - missed) / step if missed is not None else (found[0] - found[1]) / (2 * step))
        return np.array(columns).T

    # --- Newton's method ----------------------------------------------------------------------------------------------

    def solved(self, states: list[np.ndarray]) -> tuple[list[tuple[End, End, float]], float]:
        """The ends of all members next to states (14,) of their beginnings, and how far these have moved."""
        bases, x, both = self.begun(states)
        first = x.copy()
        for _ in range(12):
            missed = self.missed(both)
            if np.abs(missed).max() < _ENOUGH:
                break
            slopes = self.slopes(bases, x, _STEP, missed)
            x -= np.linalg.lstsq(slopes, missed)[0].reshape(x.shape)
            both = [self.ends(*given) for given in zip(self.order, x, bases)]
        assert np.abs(self.missed(both)).max() < 1e-9
        return both, float(np.abs(x - first).max())

    @staticmethod
    def _moment(state: np.ndarray) -> np.ndarray:
        """The moment on the lab axes from the multipliers of a quaternion: 2 M_i = lambda . (q e_i)."""
        w, x, y, z = state[:4]
        rows = np.array([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]]) / 2
        return _frame(state[:4]) @ (rows @ state[7:11])
