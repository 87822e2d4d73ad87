"""Commands that print an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from robostiff.cli.command import BAD_STATUS, print_answer, slips
from robostiff.cli.options import (
    Answer,
    Command,
    Loads,
    Model,
    Posing,
    argument,
    group,
    length_option,
    option,
    plot_option,
    repeatable,
    wrench_option,
)
from robostiff.cli.output import draw, picture_beside
from robostiff.errors import InputError, Words

if TYPE_CHECKING:
    from robostiff.cables import TensionRule


class Check(Command, name="check"):
    """Check a model or snapshot file, and list the parts of the robot.

    $ check hexapod --parts --plot hexapod.png

    Exit status: 0 when it can be used, 2 when it cannot.
    """

    model: Model = group(Model)
    parts: bool = option(
        "--parts",
        help="List joints, elastic parts and cables at home: where they are, coordinates, "
        "lengths, stiffnesses of each direction alone in the part's own axes, limits.",
    )
    plot: str | None = plot_option("Draw the robot")
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print the parts of a robot; reading the file checks it."""
        from robostiff.page.facts import facts_of, facts_page

        picture = picture_beside(self.plot, self.answer)
        doubts: list[str] = []
        with slips(doubts.append):
            robot = self.model.load()
            facts = facts_of(robot, with_parts=self.parts)
        if doubts:
            facts["warnings"] = doubts
        if picture is not None:
            from robostiff import plot

            drawn = plot.robot(robot, colouring=plot.Colouring.NAMES, backend=plot.PictureData())
            draw(drawn, picture)
            facts["picture"] = str(picture)
        return print_answer(facts_page(facts), self.answer)


class PrintStiffness(Command, name="stiffness"):
    """Print the Cartesian stiffness matrix of a robot at a pose, its rank and free motions.

    $ stiffness gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    method: str = option(
        "--method",
        metavar="NAME",
        default="wrench-basis",
        help="wrench-basis, saddle-point, block, recursive or index-rules.",
    )
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print K at a pose."""
        from robostiff.analysis.posed_stiffness import stiffness
        from robostiff.cli import arguments as written
        from robostiff.elastostatics import Block, IndexRules, Recursive, SaddlePoint, WrenchBasis

        forms = (WrenchBasis(), SaddlePoint(), Block(), Recursive(), IndexRules())
        form = written.choice("--method", self.method, {form.name: form for form in forms})
        robot = written.load_machine(self.model, self.place)
        return print_answer(
            stiffness(robot, method=form, **written.where(robot, self.place)), self.answer
        )


class PrintDeflection(Command, name="deflection"):
    """Print deflection, elastic energy of parts and actuator loads of a robot under a load.

    $ deflection gough-stewart-b-beams --wrench "200 N 0 -500 0 0 0"
    $ deflection six-joint-arm --gravity=-z --weight "platform=5 kg"
    """

    model: Model = group(Model)
    loads: Loads = group(Loads, "wrench", "weights", "forces", "gravity")
    place: Posing = group(Posing)
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print the deflection under small loads."""
        from robostiff.cli import arguments as written

        robot, loads = written.load_machine(self.model, self.place), self.loads
        on_bodies = loads.gravity is not None or loads.weights or loads.forces
        if loads.wrench is None and not on_bodies:
            expected = '--wrench, such as "0 0 -500 N 0 0 0", --gravity=-z, --load or --weight'
            raise InputError("load of a deflection", got=Words("none"), expected=expected)
        options = written.where(robot, self.place)
        options["wrench"] = written.wrench(loads.wrench, robot.space)
        if on_bodies or (getattr(robot, "legs", ()) and robot.springs):
            # what legs alone do not decide takes twice as long to import
            from robostiff.statics import deflection as deflection_by_bodies

            options |= {
                "loads": written.body_loads(loads),
                "gravity": written.gravity(loads.gravity),
            }
            result = deflection_by_bodies(robot, **options)
        else:
            from robostiff.analysis import deflection

            result = deflection(robot, **options)
        return print_answer(result, self.answer)


class PrintEquilibrium(Command, name="equilibrium"):
    """Print where a robot comes to rest under finite loads, its stiffness there, and its stability.

    $ equilibrium hexapod --wrench "0 0 -50 kN 0 0 0" --weight "leg1/strut=12 kg" --critical
    $ equilibrium six-joint-arm --gravity=-z --wrench "0 0 -150 N 0 0 0" --factors "0 4 9"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    loads: Loads = group(Loads)
    critical: bool = option("--critical", help="Find the critical load, and how the robot leaves.")
    factors: str | None = option(
        "--factors",
        metavar='"START STOP COUNT"',
        help="Multiples of the wrench at which to give the force-deflection curve.",
    )
    plot: str | None = plot_option("Draw the loaded shape, or with --factors the curve,")
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print where a robot comes to rest under loads; 1 for a bad status."""
        from robostiff.cli import arguments as written
        from robostiff.page.loads import equilibrium_page
        from robostiff.statics import critical_load, equilibrium, load_path

        robot = written.load_machine(self.model, self.place)
        F = written.wrench(self.loads.wrench, robot.space)
        for name, value in (("--critical", self.critical), ("--factors", self.factors)):
            if F is None and value:
                raise InputError(name, expected='--wrench beside it, such as "0 0 -1 kN 0 0 0"')
        picture = picture_beside(self.plot, self.answer, is_scene=self.factors is None)
        options = {"wrench": F, **written.loading(robot, self.place, self.loads)}
        factors = None if self.factors is None else written.factors(self.factors)
        result: Any = equilibrium(robot, **options)
        critical = critical_load(robot, **options) if self.critical else None
        curve = None if factors is None else load_path(robot, factors=factors, **options)
        if picture is not None:
            from robostiff import plot

            drawn_by: Any = plot.equilibrium if curve is None else plot.load_curve
            of = result if curve is None else curve
            draw(drawn_by(of, backend=plot.PictureData()), picture)
        return print_answer(equilibrium_page(result, critical, curve), self.answer)


class PrintModes(Command, name="modes"):
    """Print natural frequencies and modes about the equilibrium, without load or under one.

    Masses are those of the model, and those of --mass.

    $ modes hexapod --mass "platform=150 kg"
    $ modes six-joint-arm --gravity=-z --plot first-mode.html
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    masses: tuple[str, ...] = repeatable(
        "--mass",
        '"LEG/PART=MASS"',
        "A mass [kg] that moves with the body behind a part, or with 'platform', and has no weight",
    )
    number: int = option(
        "--mode",
        metavar="NUMBER",
        type=int,
        default=1,
        help="Which mode to draw, 1 for the slowest.",
    )
    plot: str | None = plot_option("Draw a mode, which moves on a page (.html),")
    loads: Loads = group(Loads)
    answer: Answer = group(Answer)

    def run(self) -> int:
        """Print how a robot vibrates about its equilibrium; 1 for a bad status."""
        from robostiff.cli import arguments as written
        from robostiff.page.facts import masses_at_home, masses_in_words
        from robostiff.page.loads import modes_page
        from robostiff.statics import modes

        picture = picture_beside(self.plot, self.answer)
        robot = written.load_machine(self.model, self.place)
        options = written.loading(robot, self.place, self.loads)
        moving = written.by_part("--mass", self.masses, written.kilograms)
        F = written.wrench(self.loads.wrench, robot.space)
        result = modes(robot, masses=moving, wrench=F, **options)
        if picture is not None:
            from robostiff import plot

            data = plot.PictureData()
            other_end = plot.mode(result, self.number, -1.0, backend=data)
            draw(plot.mode(result, self.number, backend=data), picture, other_end)
        masses = masses_at_home(robot)
        words = masses_in_words(masses, "masses of the model")
        if moving:
            listed = ", ".join(f"{k} {m:.4g} kg" for k, added in moving.items() for m in added)
            words.append(f"beside them: {listed}")
        return print_answer(modes_page(result, masses.get("masses"), tuple(words)), self.answer)


class PrintResponse(Command, name="response"):
    """Print displacements, reactions and beam forces of a network under loads, all together.

    $ response portal.json --along "beam=0 0 -2 kN/m" --load "corner=100 N 0 0"

    Exit status: 0 for an answer, 1 for none, 2 for bad input.
    """

    source: str = argument("FILE", "A snapshot file with a graph: a network.")
    at_nodes: tuple[str, ...] = repeatable(
        "--load",
        '"NODE=fx fy fz [mx my mz]"',
        "Force [N], and moment [N m], at the point of a node",
    )
    along_beams: tuple[str, ...] = repeatable(
        "--along", '"BEAM=qx qy qz"', "Uniform force along a whole beam [N/m]"
    )
    on_beams: tuple[str, ...] = repeatable(
        "--on", '"BEAM=s fx fy fz"', "Force [N] on a beam at the distance s [m] from its start"
    )
    settlements: tuple[str, ...] = repeatable(
        "--settle", '"NODE=x y z rx ry rz"', "Displacement [m] and rotation [rad] of a fixed node"
    )
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print how a network answers its loads."""
        from robostiff.cli.arguments import check_kind, network_loads, settlements
        from robostiff.network import network_response
        from robostiff.robots import load

        network, source = load(self.source), self.source
        hints = {"cable robot": f"write 'robostiff cables {source} --wrench ...'"}
        check_kind(
            network,
            {"network"},
            f"response of {source!r}",
            expected="a network: a snapshot file with a graph",
            hint=hints.get(
                network.kind, f"write one: robostiff convert {source} --to graph -o network.json"
            ),
        )
        loads = network_loads(self.at_nodes, self.along_beams, self.on_beams, network.space)
        moved = settlements(self.settlements, network.space)
        if not loads and not moved:
            expected = "--load, --along, --on or --settle"
            raise InputError(f"loads of {source!r}", got=Words("none"), expected=expected)
        return print_answer(network_response(network, loads, settlements=moved), self.answer)


class PrintIndices(Command, name="indices"):
    """Print stiffness indices: principal stiffnesses, directions, centres and axes.

    $ indices hexapod --pose "60 mm 0 0.9 0 10 deg 0" --length "100 mm"
    """

    model: Model = group(Model)
    place: Posing = group(Posing)
    length: str | None = length_option()
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print the stiffness indices at a pose; 1 for a bad status."""
        from robostiff.analysis import stiffness
        from robostiff.analysis.indices import indices
        from robostiff.cli import arguments as written
        from robostiff.page.indices import indices_page

        robot = written.load_machine(self.model, self.place)
        written.check_kind(
            robot,
            {"robot", "snapshot", "network", "linkage"},
            f"indices of {robot.name!r}",
            expected="a robot with legs: the stiffness of cables depends on their tensions",
        )
        result = stiffness(robot, **written.where(robot, self.place))
        if not result.answered.all():
            return print_answer(indices_page(result), self.answer)
        return print_answer(indices(result, length=written.length(self.length)), self.answer)


class PrintVerification(Command, name="verify"):
    """Compute the stiffness matrix by all methods, and report whether they agree.

    $ verify gough-stewart-b --pose "10 mm 0 0.8 0 0 10 deg"

    Exit status: 0 when the methods agree, 1 when they do not, 2 for bad input.
    """

    model: Model = group(Model)
    place: Posing = group(Posing, "pose", "joints", "near")
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print the distances between the methods at a pose; 1 when they disagree."""
        from robostiff.analysis.verification import verify
        from robostiff.cli import arguments as written

        robot = self.model.load()
        pose, near = written.pose(robot, self.place), written.near(robot, self.place)
        result = verify(robot, pose, near=near)
        print_answer(result, self.answer)
        return 0 if result.agree else BAD_STATUS


class PrintCables(Command, name="cables"):
    """Print tensions and stiffness of a cable robot, and which cables become slack under a load.

    $ cables cable-8 --pose "0.5 0.2 1 0 0 0" --wrench "0 0 -200 N 0 0 0"
    """

    model: Model = group(Model, "source", "settings")
    place: Posing = group(Posing, "pose")
    wrench: str | None = wrench_option(
        "A load on top of the weight while the winches are locked: how the platform moves, and "
        "which cables become slack"
    )
    balance: str | None = wrench_option(
        "A wrench that the tensions balance at the pose itself", name="--balance"
    )
    rule: str = option(
        "--rule", metavar="NAME", default="nearest", help="Of the tensions: nearest or closed-form."
    )
    level: float | None = option(
        "--level",
        metavar="NUMBER",
        type=float,
        help="Where between least (0) and greatest (1) tensions they aim.",
    )
    tensions: str | None = option(
        "--tensions", metavar='"t1 t2 ..."', help="The tensions themselves [N], one a cable."
    )
    answer: Answer = group(Answer, "as_json")

    def run(self) -> int:
        """Print tensions and stiffness at a pose, or the response to a load."""
        from robostiff.analysis import cable_stiffness
        from robostiff.cables import ClosedFormTensions, GivenTensions, NearestTensions
        from robostiff.cli import arguments as written
        from robostiff.io.units import Dimension, parse_quantities
        from robostiff.statics import cable_response

        robot, source = self.model.load(), self.model.source
        written.check_kind(
            robot,
            {"cable robot"},
            f"cables of {source!r}",
            expected="a robot with cables, such as cable-8",
            hint=f"write 'robostiff stiffness {source}' for a robot with legs",
        )
        if self.rule not in {"nearest", "closed-form"}:
            raise InputError("--rule", got=self.rule, expected="nearest or closed-form")
        is_closed, level = self.rule == "closed-form", self.level
        rule: TensionRule | None = None if level is None else NearestTensions(level)
        if self.tensions is not None:
            if level is not None or is_closed:
                option = "--rule" if level is None else "--level"
                raise InputError(f"--tensions and {option}", expected="one of them")
            names = robot.cable_names
            forces = [Dimension.FORCE] * len(names)
            rule = GivenTensions(parse_quantities(self.tensions, forces, names, "--tensions"))
        elif is_closed:
            rule = ClosedFormTensions() if level is None else ClosedFormTensions(level)
        pose = written.pose(robot, self.place)
        if self.wrench is not None and self.balance is not None:
            raise InputError("--wrench and --balance", expected="one of them")
        if self.wrench is not None:
            load = written.wrench(self.wrench, robot.space)
            return print_answer(cable_response(robot, pose, load, tensions=rule), self.answer)
        balanced = written.wrench(self.balance, robot.space, "--balance")
        return print_answer(cable_stiffness(robot, pose, balanced, tensions=rule), self.answer)
