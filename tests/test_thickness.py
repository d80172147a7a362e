"""The thickness report: numbers against known solids, files, and bad input."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from PIL import Image
from truefield.facets import refined

FILES = {
    "report.json",
    "samples.csv",
    "heavy-sections.csv",
    "thickness.ply",
    "histogram.png",
    "thickness.png",
    "heavy-sections.png",
}


@pytest.fixture(scope="module")
def slab() -> tf.ThicknessReport:
    return tf.thickness(tf.shapes.box((40.0, 30.0, 6.0)), tolerance=0.05, above=5.0, below=6.5, spacing=0.7)


def test_a_slab_has_its_depth_its_thickness_and_one_heavy_section(slab: tf.ThicknessReport) -> None:
    depth = slab.greatest_depth.depth
    assert depth.lower <= 3.0 + 1e-9
    assert depth.upper >= 3.0 - 1e-9
    assert depth.upper - depth.lower <= 0.05
    assert slab.heavy is not None
    assert slab.heavy.depth == 2.5
    (section,) = slab.heavy_sections
    volume = 35.0 * 25.0 * 1.0
    assert section.certain
    assert section.volume.lower <= volume <= section.volume.upper
    assert section.depth.upper - section.depth.lower <= 0.05
    sphere = slab.walls.sphere
    assert sphere is not None
    assert sphere.minimum.thickness == pytest.approx(6.0, abs=1e-9)
    assert sphere.maximum.thickness == pytest.approx(6.0, abs=1e-9)
    assert sphere.mean == pytest.approx(6.0, abs=1e-9)
    assert set(sphere.percentiles) == {1, 5, 95, 99}
    assert (sphere.share_above, sphere.share_below) == (1.0, 1.0)
    assert slab.walls.edge.samples > 0
    assert slab.walls.missed == 0


def test_samples_stand_for_the_whole_area(slab: tf.ThicknessReport) -> None:
    found = slab.samples
    assert found.area.sum() == pytest.approx(2 * (40 * 30 + 40 * 6 + 30 * 6))
    assert np.allclose(np.linalg.norm(found.normal, axis=1), 1.0)
    surface = tf.Surface(tf.shapes.box((40.0, 30.0, 6.0)))
    assert np.abs(surface.distance(found.point)).max() < 1e-12
    centers = found.point - found.normal * found.thickness_sphere[:, None] / 2
    assert np.allclose(surface.distance(centers), -found.thickness_sphere / 2, atol=1e-9)
    with pytest.raises(ValueError, match="read-only"):
        found.area[0] = 1.0


def test_json_has_stable_keys_and_no_numbers_that_json_lacks(slab: tf.ThicknessReport) -> None:
    document = json.loads(slab.to_json())
    assert document["schema"] == "truefield.thickness/1"
    assert set(document) == {
        "schema",
        "truefield",
        "units",
        "part",
        "tolerance",
        "limits",
        "sign_rule",
        "greatest_depth",
        "greatest_thickness",
        "heavy_sections",
        "wall_thickness",
        "summary",
    }
    (section,) = document["heavy_sections"]["sections"]
    assert set(section) == {"point", "depth", "thickness", "volume", "box", "centroid", "certain"}
    assert section["thickness"]["lower"] == 2.0 * section["depth"]["lower"]
    wall = document["wall_thickness"]
    assert set(wall["sphere"]["percentiles"]) == {"1", "5", "95", "99"}
    assert set(wall["sphere"]["minimum"]) == {"thickness", "point", "triangle", "opposite", "opposite_triangle"}
    assert slab.to_json() == slab.to_json()


def test_the_report_is_the_same_for_any_number_of_threads() -> None:
    part = tf.shapes.make("connector")
    one, two, seven = (tf.thickness(part, 0.05, above=3.0, threads=n).to_json() for n in (1, 2, 7))
    assert one == two == seven


def test_the_folder_holds_everything(slab: tf.ThicknessReport, tmp_path: Path) -> None:
    folder = tmp_path / "report"
    written = slab.write(folder)
    assert {path.name for path in written} == FILES == {path.name for path in folder.iterdir()}
    assert [path.name for path in tmp_path.iterdir()] == ["report"]
    assert json.loads((folder / "report.json").read_text()) == json.loads(slab.to_json())
    with (folder / "samples.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(slab.samples)
    assert [float(row["thickness_sphere"]) for row in rows] == slab.samples.thickness_sphere.tolist()
    assert {"x", "y", "z", "nx", "ny", "nz", "triangle", "area", "thickness_ray", "kind", "slack"} < set(rows[0])
    with (folder / "heavy-sections.csv").open() as stream:
        (row,) = csv.DictReader(stream)
    assert float(row["depth_lower"]) == slab.heavy_sections[0].depth.lower
    for name in ("histogram.png", "thickness.png", "heavy-sections.png"):
        with Image.open(folder / name) as image:
            colours = image.convert("RGB").getcolors(maxcolors=1 << 24)
            assert colours is not None
            assert len(colours) > 100, f"{name} is empty"
    header, _, body = (folder / "thickness.ply").read_bytes().partition(b"end_header\n")
    count = int(re.search(rb"element vertex (\d+)", header)[1])  # type: ignore[index]
    assert b"property double thickness\n" in header
    table = np.frombuffer(body[: 32 * count]).reshape(count, 4)
    assert np.isfinite(table).all()
    assert np.median(table[:, 3]) == pytest.approx(6.0, abs=1e-6)
    again = tf.read(folder / "thickness.ply")
    assert again.extent[1].tolist() == [20.0, 15.0, 3.0] or np.ptp(again.vertices, axis=0).tolist() == [40, 30, 6]


def test_files_are_replaced_together_and_others_left_alone(slab: tf.ThicknessReport, tmp_path: Path) -> None:
    folder = tmp_path / "report"
    folder.mkdir()
    (folder / "report.json").write_text("old")
    (folder / "mine.txt").write_text("keep")
    slab.write(folder, pictures=False)
    assert (folder / "mine.txt").read_text() == "keep"
    assert json.loads((folder / "report.json").read_text())["schema"]


def test_a_folder_that_cannot_be_written_is_said_and_nothing_is_left(slab: tf.ThicknessReport, tmp_path: Path) -> None:
    with pytest.raises(tf.FileError, match="does not exist"):
        slab.write(tmp_path / "none" / "report")
    (tmp_path / "file").write_text("")
    with pytest.raises(tf.FileError, match="file"):
        slab.write(tmp_path / "file")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_limit_deeper_than_the_part_is_no_error_but_a_sentence(tmp_path: Path) -> None:
    report = tf.thickness(tf.shapes.box((8.0, 6.0, 4.0)), 0.05, above=50.0)
    assert report.heavy_sections == ()
    assert any("No section is heavy" in sentence for sentence in report.sentences())
    assert any("greatest wall thickness is between 4" in sentence for sentence in report.sentences())
    folder = tmp_path / "report"
    report.write(folder)
    assert (folder / "heavy-sections.csv").read_text().count("\n") == 1


def test_without_limits_there_are_no_sections_and_no_shares() -> None:
    report = tf.thickness(tf.shapes.box((8.0, 6.0, 4.0)))
    assert report.heavy is None
    document = json.loads(report.to_json())
    assert document["heavy_sections"] is None
    assert document["wall_thickness"]["ray"]["share_above"] is None
    assert report.tolerance == pytest.approx(1e-3 * np.sqrt(116.0))


def test_a_cube_has_no_opposing_walls_away_from_its_edges_yet_a_report(tmp_path: Path) -> None:
    report = tf.thickness(tf.shapes.cube(5.0), 0.05, above=4.0)
    assert report.walls.edge.area > 0.9 * report.walls.area
    ray = report.walls.ray
    assert ray is not None
    assert ray.mean == pytest.approx(5.0)
    report.write(tmp_path / "report")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
        ({"tolerance": 1e-18}, "tolerance"),
        ({"tolerance": "thin"}, "tolerance"),
        ({"tolerance": 0.1, "above": 0.0}, "above"),
        ({"tolerance": 0.1, "above": float("inf")}, "above"),
        ({"tolerance": 0.1, "below": -2.0}, "below"),
        ({"tolerance": 0.1, "spacing": 0.0}, "spacing"),
        ({"tolerance": 0.1, "spacing": 1e-9}, "spacing"),
        ({"tolerance": 0.1, "threads": 0}, "threads"),
    ],
)
def test_bad_arguments_are_one_clear_sentence(options: dict[str, Any], word: str) -> None:
    with pytest.raises(tf.TruefieldError, match=word) as raised:
        tf.thickness(tf.shapes.box((3.0, 2.0, 1.0)), **options)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("tolerance", [1.0, 2.6, 4.0, 10.0, 1e6, 1e300])
def test_a_tolerance_wider_than_the_part_is_deep_is_still_answered(tolerance: float) -> None:
    report = tf.thickness(tf.shapes.cube(5.0), tolerance=tolerance, above=1.0)
    depth = report.greatest_depth.depth
    assert depth.lower <= 2.5 <= depth.upper
    assert depth.upper - depth.lower <= tolerance
    (section,) = report.heavy_sections
    assert section.depth.lower <= 2.5 <= section.depth.upper
    assert section.volume.lower <= 64.0 <= section.volume.upper


def test_what_has_no_inside_is_refused() -> None:
    box = tf.shapes.box((3.0, 2.0, 1.0))
    with pytest.raises(tf.TruefieldError, match="no inside"):
        tf.thickness(tf.Surface(box, sign="unsigned"), 0.1)
    sheet = tf.TriangleMesh(box.vertices, box.triangles[:2])
    with pytest.raises(tf.TruefieldError, match="no inside"):
        tf.thickness(sheet, 0.1)
    with pytest.raises(tf.TruefieldError, match="TriangleMesh"):
        tf.thickness("part.stl", 0.1)  # type: ignore[arg-type]


def test_progress_is_heard_and_may_end_the_job() -> None:
    class EnoughError(Exception):
        pass

    def enough(phase: str, fraction: float) -> None:
        assert isinstance(phase, str)
        assert 0.0 <= fraction <= 1.0
        raise EnoughError

    with pytest.raises(EnoughError):
        tf.thickness(tf.shapes.sphere(10.0), 0.001, above=1.0, spacing=0.02, progress=enough)


def test_facets_are_split_without_cracks_or_change_of_shape() -> None:
    for part in (tf.shapes.box((9.0, 5.0, 1.0)), tf.shapes.six_pointed_star()):
        longest = 0.11 * float(np.linalg.norm(part.extent[1] - part.extent[0]))
        fine, parents = refined(part, longest)
        edges = fine.vertices[fine.triangles] - fine.vertices[np.roll(fine.triangles, 1, axis=1)]
        assert np.linalg.norm(edges, axis=2).max() <= longest
        before, after = part.check(), fine.check()
        assert after.watertight
        assert after.consistent
        assert after.volume == pytest.approx(before.volume)
        assert after.area == pytest.approx(before.area)
        centers = fine.vertices[fine.triangles].mean(axis=1)
        assert np.abs(tf.Surface(part).distance(centers)).max() < 1e-12
        assert set(parents.tolist()) == set(range(len(part.triangles)))
