"""Reports: the robot and its results as one page, into HTML, Typst and PDF, and into files."""

from __future__ import annotations

import gzip
import platform
import re
from base64 import b85encode
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from robostiff.analysis import CableStiffness
from robostiff.analytic.export.documents import TYPST_DERIVATIONS, typst_pdf
from robostiff.elastostatics import Status
from robostiff.errors import InputError, Words, needs_extra
from robostiff.kinematics import Near, Pose
from robostiff.linkage import Linkage
from robostiff.markup import (
    TYPST_BLOCKS,
    Block,
    Bullets,
    Facts,
    Folded,
    Heading,
    Number,
    Page,
    Paragraph,
    Section,
    Table,
    Tone,
    Verbatim,
    block_html,
    block_typst,
    blocks_html,
    blocks_typst,
    element,
    escaped,
    in_words,
    row,
    typst_string,
    typst_text,
)
from robostiff.model import Actuated, Robot, Snapshot
from robostiff.network import Network
from robostiff.page.facts import JOINT_UNITS, leg_table, part_tables, parts_at_home
from robostiff.plot.backend import swinging_script
from robostiff.report.contents import (
    NO_TITLE_BLOCK,
    DescribedBy,
    ReportContents,
    Reported,
    TitleBlock,
    report_contents,
)
from robostiff.report.figures import TypesetFormula, figures_in, figures_json
from robostiff.report.results import (
    bending_section,
    comparison_section,
    findings_section,
    finite_load_section,
    map_section,
    matrices_section,
    vibrations_section,
    weakest_section,
)
from robostiff.version import __version__
from robostiff.whole_file import whole_file

if TYPE_CHECKING:
    import xarray


def robot_section(contents: ReportContents) -> Section | None:
    """Source, free coordinates, joints of a linkage, and legs; nothing where none is known."""
    robot = contents.robot
    free = ", ".join(coordinate.value for coordinate in robot.coordinates)
    facts = {"source": contents.source, "free coordinates of the platform": free}
    blocks: list[Block | None] = [Facts(tuple(fact for fact in facts.items() if fact[1]))]
    if contents.joints:
        blocks.append(Table(["joint", "coordinate"], list(contents.joints.items())))
    legs = leg_table(robot)
    if legs is not None:
        title = f"{len(legs.rows)} legs, element by element"
        blocks.append(legs if len(legs.rows) == 1 else Folded(title, (legs,)))
    return Section("robot", "The robot", blocks) if any(facts.values()) or blocks[1:] else None


_OF_PASSIVE_JOINTS = (
    "A. Pashkevich, A. Klimchik, S. Caro, D. Chablat: Cartesian stiffness matrix of manipulators "
    "with passive joints: analytical approach, 2011"
)
_OF_CABLES = (
    "S. Behzadipour, A. Khajepour: Stiffness of cable-based parallel manipulators with application "
    "to stability analysis, 2006"
)
_PACKAGES = ("numpy", "scipy", "sympy")


def method_section(contents: ReportContents) -> Section:
    """Method, point, conventions and versions."""
    result = contents.stiffness
    pose = ", ".join(contents.given) or "its own"
    if result.pose is not None:
        pose = f"[{row(result.pose)}] (m, rad): x, y, z and rotation vector of the platform"
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    facts = {
        "method": (
            f"elastic and geometric stiffness of the cables; tensions by the rule {result.rule}"
            if isinstance(result, CableStiffness)
            else f"{result.method.name}: {result.method.equation}"
        ),
        "pose": pose,
        "reference point": f"({row(result.reference_point)}) m",
        "conventions": "F = K t in world axes; twist: displacement of the reference point, then "
        "rotation; wrench: force, then moment about the reference point; SI units",
        "theory": _OF_CABLES if isinstance(result, CableStiffness) else _OF_PASSIVE_JOINTS,
        "versions": f"robostiff {__version__}, Python {platform.python_version()}, {packages}",
    }
    grid = contents.found
    if grid is not None:
        poses = grid.attrs.get("poses", "unknown")
        facts["map"] = f"{poses} poses, robostiff {grid.attrs.get('robostiff_version', 'unknown')}"
    if contents.no_derivation:
        facts["formula"] = f"none: {contents.no_derivation}"
    return Section("method", "How it was computed", [Facts(tuple(facts.items()))])


def formula_section(contents: ReportContents) -> Section | None:
    """The derivation step by step; nothing where there is none."""
    if contents.derivation is None:
        return None
    words = "Derivation of the stiffness matrix in the home configuration, step by step"
    folded = Folded(words, (TypesetFormula(contents.derivation),))
    return Section("formula", "The formula", [folded])


def inputs_section(contents: ReportContents) -> Section:
    """All values that the results follow from, so that they can be checked and computed again."""
    robot, known = contents.robot, contents.described_by
    blocks: list[Block] = []
    if known is not None and known.parameters:
        changed, heads = known.changed, ["parameter", "value", "changed"]
        rows = [
            [name, str(changed.get(name, value)), f"instead of {value}" if name in changed else ""]
            for name, value in known.parameters.items()
        ]
        if not changed:
            heads, rows = heads[:2], [cells[:2] for cells in rows]
        blocks += [Heading("Parameters"), Table(heads, rows)]
    numeric: Any = robot.numeric
    tables: list[Block] = [*part_tables(parts_at_home(numeric))]
    if not robot.is_frozen and getattr(numeric, "is_coupled", False):
        rows = []  # sums of joint coordinates
        for leg in numeric.legs:
            transmission = leg.chain.transmission
            for i, coupling in () if transmission is None else transmission.sums.items():
                place = leg.chain.own_places[i]
                turns, k = leg.chain.freedoms[place].turns, coupling.role.stiffness
                rows.append(
                    [
                        f"{leg.name}/{coupling.name}",
                        coupling.in_words,
                        Number(float(leg.chain.home[place]), "rad" if turns else "m"),
                        "actuated" if isinstance(coupling.role, Actuated) else "locked",
                        "rigid" if k is None else Number(float(k), JOINT_UNITS[bool(turns)]),
                    ]
                )
        tables.append(Table(["coupling", "sum", "at home", "role", "stiffness"], rows))
    if hasattr(numeric, "cables"):
        blocks += tables
        if numeric.weight is not None:
            force, point = row(numeric.weight.force), row(numeric.weight.point)
            blocks.append(Paragraph(f"Weight ({force}) N at ({point}) m of the platform."))
    else:
        at = " in the home configuration" if hasattr(numeric, "legs") else ""
        blocks.append(Folded(f"Joints and elastic parts{at}, in world axes [m]", tuple(tables)))
        blocks.append(Paragraph("Parts that are not listed as elastic are rigid.", Tone.QUIET))
    if known is not None:
        blocks.append(Table(["file", "SHA-256"], list(known.files.items())))
        blocks.append(Folded(f"The file {known.name}", (Verbatim(known.text),)))
    return Section("inputs", "What was given", blocks)


_PAGES, _PAPER = (".html", ".htm"), ".pdf"
_SECTIONS = (
    *(findings_section, robot_section, matrices_section, weakest_section, bending_section),
    *(finite_load_section, vibrations_section, comparison_section, map_section),
    *(inputs_section, method_section, formula_section),
)


def report_page(contents: ReportContents) -> Page:
    """A report as a page: where and with which status, all advice, and its sections."""
    robot, result = contents.robot, contents.stiffness
    place = (
        f"At {', '.join(contents.given) or 'home'}"
        if contents.joints
        else f"At the pose of the {robot.kind}"
        if result.pose is None
        else f"At the pose [{row(result.pose)}] (m, rad)"
    )
    is_placed = isinstance(result, CableStiffness) or Status.UNREACHABLE not in result.status
    reached = is_placed and int(result.rank) >= 0
    return Page(
        f"{robot.name}: {robot.title}" if robot.title else robot.name,
        place,
        contents.status,
        [block for section in _SECTIONS if (block := section(contents)) is not None],
        (*result.advice, *(f"under the load: {words}" for words in contents.advice_of_load)),
        posture=f", rank {int(result.rank)} of {result.space.size}" if reached else "",
    )


def report_html(contents: ReportContents) -> str:
    """A report as one HTML page that contains its style, script and figures.

    Raises InputError when Plotly or Matplotlib is missing.
    """
    page = report_page(contents)
    lines, status = contents.title_block.lines, contents.status
    block = element("div", block_html(Facts(lines)), class_="title-block") if lines else ""
    kind = "bad" if status.is_bad else "note" if status else "ok"
    word = element("span", escaped(status), class_=f"status-{kind}")
    lead = element("p", f"{in_words(page.place)}: status {word}{page.posture}.", class_="lead")
    links = (
        element("a", escaped(section.title), href=f"#{section.anchor}")
        for section in page.blocks
        if isinstance(section, Section)
    )
    return Template(_resource("page.html")).substitute(
        title=escaped(page.name),
        lead=block + lead + block_html(Bullets(tuple(page.advice), Tone.WARNING)),
        version=__version__,
        links="\n".join(links),
        sections=blocks_html(page.blocks),
        figures=pack(figures_json(figures_in(page.blocks))),
        style=_resource("page.css"),
        script=swinging_script() + _resource("page.js"),
        plotly=_packed_plotly(),
    )


# the program that draws tiles of street maps, a tenth of Plotly, which no figure of a report has
_STREET_MAPS = re.compile(r"\bexports='(?=(?:[^'\\]|\\.){100000})(?:[^'\\]|\\.)*'")


@cache
def _packed_plotly() -> str:
    with needs_extra("plots", "plot"):
        from plotly.offline import get_plotlyjs
    return pack(_STREET_MAPS.sub("exports=''", get_plotlyjs()))


# RFC 1924, with a full stop in place of the one character that could begin a tag
_HTML = bytes.maketrans(b"<", b".")


def pack(text: str) -> str:
    """Text as the script of the page unpacks it: compressed, in characters that HTML leaves alone.

    The same text is packed in the same way each time.
    """
    compressed = gzip.compress(text.encode(), 9, mtime=0)
    return b85encode(compressed).translate(_HTML).decode("ascii")


def _resource(name: str) -> str:
    return files("robostiff.report").joinpath(name).read_text(encoding="utf-8")


_PREAMBLE = """\
#set document(title: {title}, date: none)
#set page(
  paper: "a4", margin: (x: 20mm, y: 15mm), numbering: "1 / 1",
  footer: context [
    #set text(size: 8pt, fill: luma(90))
    robostiff {version} #h(1fr) #counter(page).display("1 / 1", both: true)
  ],
)
#set text(size: 9pt)
#show table: set text(size: 8pt)
#set par(justify: false)
#show heading: set block(above: 1.3em, below: 0.8em, sticky: true)
#show figure: set block(above: 1.2em, below: 1.2em)
#show figure.caption: set text(size: 9pt)
#set figure(numbering: none)
"""


def report_typst(contents: ReportContents) -> str:
    """A report as the source of a Typst document; its figures are inside.

    Raises InputError when Matplotlib is missing.
    """
    page, lines = report_page(contents), contents.title_block.lines
    written = [
        _PREAMBLE.format(title=typst_string(page.name), version=typst_text(__version__)),
        TYPST_BLOCKS,
        TYPST_DERIVATIONS,
        f"#text(size: 16pt, weight: 700)[{typst_text(page.name)}]",
        *([block_typst(Facts(lines))] if lines else []),
        f"{typst_text(page.place)}: status *{typst_text(str(page.status))}*{page.posture}.",
        *([block_typst(Bullets(tuple(page.advice), Tone.WARNING))] if page.advice else []),
        blocks_typst(page.blocks),
    ]
    return "\n\n".join(written) + "\n"


def report_pdf(contents: ReportContents) -> bytes:
    """A report as a PDF; InputError when Typst or Matplotlib is missing."""
    return typst_pdf(report_typst(contents))


def write_report(
    robot: Reported | Linkage,
    path: str | Path,
    pose: Pose | Mapping[str, Any] = None,
    *,
    wrench: ArrayLike | None = None,
    at: ArrayLike | None = None,
    near: Near = None,
    found: xarray.Dataset | None = None,
    finite: bool = False,
    title_block: TitleBlock = NO_TITLE_BLOCK,
    described_by: DescribedBy | None = None,
    other: Robot | Snapshot | Network | None = None,
) -> None:
    """Write a report about a robot at a pose: an HTML page or a PDF.

    Parameters
    ----------
    robot : Robot, Snapshot, Network, Linkage or CableRobot
    path : str or Path
        The file to write: ``.html`` opens in any browser without a network and has figures to turn
        and sliders; ``.pdf`` is for paper. A file of that name is replaced once all is written.
    pose : RigidTransform, array, JointCoordinates, mapping or None
        One pose, as for `robostiff.stiffness`; of a linkage coordinates of joints by name.
    wrench : (6,) array, or (3,) for a planar robot, optional
        A load [N, N m] about `at`: adds the deflection and the elastic energy of each part.
    at : (3,) array, optional
        Point about which stiffness and load are given, in the world [m].
    near : joint coordinates, optional
        Those that choose the posture, as for `robostiff.stiffness`.
    found : xarray.Dataset, optional
        A map of this robot over a grid: adds slices of the workspace.
    finite : bool
        Whether to answer for a finite wrench too: where the robot comes to rest, its stiffness
        there, the critical load, and the force-deflection curve.
    title_block : TitleBlock, optional
        Project, author, date and revision.
    described_by : DescribedBy, optional
        The file of the robot, as ``robostiff.report.described_by(path)`` reads it.
    other : Robot or Snapshot, optional
        A design that is compared, at the same pose and under the same load.

    Raises
    ------
    InputError
        When an argument does not fit, the file has another ending or no directory, or an optional
        package is missing.

    Examples
    --------
    ::

        rs.write_report(rs.load("hexapod"), "hexapod.html", wrench=[500, 0, 0, 0, 0, 0])
    """
    checked = report_path(path)
    contents = report_contents(
        robot,
        pose,
        wrench=wrench,
        at=at,
        near=near,
        found=found,
        finite=finite,
        title_block=title_block,
        described_by=described_by,
        other=other,
    )
    save_report(contents, checked)


def save_report(contents: ReportContents, *paths: str | Path) -> None:
    """Write a report whose contents are computed; to all files or, if one is refused, to none."""
    checked = list(map(report_path, paths))
    written = [
        report_pdf(contents) if path.suffix.lower() == _PAPER else report_html(contents).encode()
        for path in checked
    ]
    for path, data in zip(checked, written, strict=True):
        with whole_file(path) as draft:
            draft.write_bytes(data)


def report_path(path: str | Path) -> Path:
    """The path of a report, checked before anything is computed.

    Raises InputError when it ends in neither .html nor .pdf, is a directory, or lies in none.
    """
    path = Path(path)
    if path.suffix.lower() not in {*_PAGES, _PAPER}:
        raise InputError(
            "file of a report", got=str(path), expected="a name that ends in .html or .pdf"
        )
    if path.is_dir():
        raise InputError("file of a report", got=Words(f"the directory {path}"), expected="a file")
    if not path.parent.is_dir():
        got = str(path.parent)
        hint = f"create it with mkdir -p {path.parent}"
        raise InputError("directory of a report", got=got, expected="one that is there", hint=hint)
    return path
