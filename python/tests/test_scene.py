"""Documents, nodes, triangles, conversions and checks."""

import gzip
import pathlib
import warnings
from typing import Dict

import numpy as np
import pytest
from conftest import SCENE

import ivcam


def test_nodes_have_their_classes_names_lines_and_fields(scene: pathlib.Path) -> None:
    document = ivcam.open(scene)
    assert document.format == "Inventor V2.1 ascii"
    assert [n.class_name for n in document.roots] == ["Separator"]
    ball = next(document.find("Sphere"))
    assert (ball.name, ball.line) == ("Ball", 6)
    assert ball.fields == {"radius": 1.5}
    cube = next(document.find("Cube"))
    assert "height" not in cube.fields and cube["height"] == 2.0
    assert set(cube.field_names()) == {"width", "height", "depth"}
    red = next(document.find("Material"))
    np.testing.assert_array_equal(red["diffuseColor"], [[1, 0, 0]])
    assert red["diffuseColor"].dtype == np.float32


def test_bytes_are_read_as_a_file_is(scene: pathlib.Path) -> None:
    names = [n.class_name for n in ivcam.open(SCENE).nodes]
    assert names == [n.class_name for n in ivcam.open(scene).nodes]
    assert ivcam.open(SCENE).path is None


def test_a_field_that_is_set_is_drawn_and_written(scene: pathlib.Path) -> None:
    document = ivcam.open(scene)
    ball = next(document.find("Sphere"))
    before = np.abs(document.triangles().positions[:, 1]).max()
    ball["radius"] = 3
    after = np.abs(document.triangles().positions[:, 1]).max()
    assert after == pytest.approx(2 * before, rel=1e-6)
    assert b"radius 3" in document.to_bytes()


def test_a_field_of_an_inlined_file_is_drawn_and_its_loss_reported(
    scene: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    whole = b'#Inventor V2.1 ascii\nFile { name "ball.iv" } Cone { }\n'
    document = ivcam.open(whole, folder=tmp_path)
    next(document.find("Cone"))["height"] = 3.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert b"height 3" in document.to_bytes()
    assert not document.convert(tmp_path / "out.iv").losses
    next(document.find("Sphere"))["radius"] = 9.0
    assert document.triangles().positions.max() == pytest.approx(9, rel=1e-3)
    for binary in (False, True):
        with pytest.warns(ivcam.IvcamWarning, match="`Sphere` is not written.*ball.iv"):
            document.to_bytes(binary=binary)
    (loss,) = document.convert(tmp_path / "out.iv").losses
    assert (loss["feature"], loss["node"], loss["name"]) == ("edited-field", "Sphere", "Ball")
    losses = document.convert(tmp_path / "out.glb").losses
    assert "edited-field" not in {loss["feature"] for loss in losses}


def test_a_wrong_field_is_refused_with_the_nearest_name(scene: pathlib.Path) -> None:
    document = ivcam.open(scene)
    ball = next(document.find("Sphere"))
    red = next(document.find("Material"))
    with pytest.raises(ValueError, match="beyond"):
        red["diffuseColor"] = [[1, 0, -1e39]]
    with pytest.raises(KeyError, match="there is `radius`"):
        ball["radus"]
    with pytest.raises(TypeError, match="radius"):
        ball["radius"] = "wide"
    with pytest.raises(ValueError, match="`radius` of `Sphere` .* beyond the numbers of 32 bits"):
        ball["radius"] = 1e39
    assert ball["radius"] == 1.5
    for text, name, wrong in [
        (b"Switch { whichChild 0 Cube { } }", "whichChild", 2**40),
        (b"IndexedLineSet { coordIndex [ 0, 1 ] }", "coordIndex", np.array([0, -(2**40)])),
    ]:
        (node,) = ivcam.open(b"#Inventor V2.1 ascii\n" + text).roots
        with pytest.raises(ValueError, match=f"`{name}` .* beyond the field's 32 bits"):
            node[name] = wrong


def test_cameras_and_lights_are_in_world_space(scene: pathlib.Path) -> None:
    document = ivcam.open(scene)
    (camera,) = document.cameras
    assert camera["class"] == "PerspectiveCamera"
    assert camera["position"] == (0.0, 0.0, 5.0) or list(camera["position"]) == [0, 0, 5]
    (light,) = document.lights
    np.testing.assert_allclose(light["direction"], [0, -(0.5**0.5), -(0.5**0.5)], atol=1e-6)


def test_triangles_close_the_ball_and_the_cube(scene: pathlib.Path) -> None:
    found = ivcam.open(scene).triangles(tolerance=0.0005)
    a, b, c = (found.positions[found.faces[:, i]].astype(float) for i in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    exact = 4 / 3 * np.pi * 1.5**3 + 0.5 * 2 * 2
    assert volume == pytest.approx(exact, rel=0.005)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-5)
    assert found.uv.shape == (len(found.positions), 2)
    assert found.material.shape == found.node.shape == (len(found.faces),)
    assert found.materials[found.material[0]]["diffuse"] == (1.0, 0.0, 0.0) or list(
        found.materials[found.material[0]]["diffuse"]
    ) == [1, 0, 0]
    assert any(path.endswith("Ball") for path in found.paths)


def test_lines_are_reported_and_not_lost_in_silence() -> None:
    text = b"""#Inventor V2.1 ascii
Coordinate3 { point [ 0 0 0, 1 0 0 ] } LineSet { numVertices 2 }"""
    with pytest.warns(ivcam.IvcamWarning, match="1 lines"):
        found = ivcam.open(text).triangles()
    assert found.lines == 1 and len(found.faces) == 0


def test_a_conversion_writes_its_files_and_names_what_is_lost(
    scene: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    document = ivcam.open(scene)
    made = document.convert(tmp_path / "ball.glb")
    assert (tmp_path / "ball.glb").read_bytes()[:4] == b"glTF"
    assert made.format == "glb" and not made.empty
    made = document.convert(tmp_path / "ball.obj")
    assert [pathlib.Path(f).name for f in made.files] == ["ball.obj", "ball.mtl"]
    assert {"light", "camera"} <= {loss["feature"] for loss in made.losses}
    with pytest.raises(ivcam.UnsupportedError, match="glb"):
        document.convert(tmp_path / "ball.xyz")
    with pytest.raises(ivcam.ArgumentError, match="would overwrite the input"):
        document.convert(scene, format="inventor")
    assert scene.read_bytes() == SCENE


@pytest.mark.filterwarnings("ignore::ivcam.IvcamWarning")
@pytest.mark.parametrize("format", sorted(ivcam.formats()))
def test_what_a_conversion_writes_opens_with_the_same_triangles(
    format: str, scene: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    document = ivcam.open(scene)
    path = tmp_path / f"written{ivcam.formats()[format][0]}"
    made = document.convert(path, format=format)
    assert made.format == format and path.stat().st_size > 0 and not made.problems
    if format == "usda":
        assert path.read_text().startswith("#usda")
        with pytest.raises(ivcam.IvcamError):
            ivcam.open(path)
        return
    mine, theirs = document.triangles(), ivcam.open(path).triangles()
    assert len(theirs.faces) == len(mine.faces) > 100
    for end in (np.min, np.max):
        expected = end(mine.positions, axis=0)
        np.testing.assert_allclose(end(theirs.positions, axis=0), expected, atol=1e-5)


CORNERS = "0 0 0, 3 0 0, 0 4 0"
COORDINATES = f"coord Coordinate {{ point [ {CORNERS} ] }}"
TRIANGLE = f"IndexedFaceSet {{ {COORDINATES} coordIndex [ 0 1 2 -1 ] }}"
TRIANGLES: Dict[str, str] = {
    "a.iv": f"""#Inventor V2.1 ascii
Coordinate3 {{ point [ {CORNERS} ] }} FaceSet {{ numVertices 3 }}""",
    "old.iv": f"""#Inventor V1.0 ascii
Coordinate3 {{ point [ {CORNERS} ] }} FaceSet {{ numVertices 3 }}""",
    "one.wrl": f"""#VRML V1.0 ascii
Coordinate3 {{ point [ {CORNERS} ] }} IndexedFaceSet {{ coordIndex [ 0, 1, 2, -1 ] }}""",
    "two.wrl": f"#VRML V2.0 utf8\nShape {{ geometry {TRIANGLE} }}",
    "a.x3dv": f"#X3D V3.3 utf8\nPROFILE Interchange\nShape {{ geometry {TRIANGLE} }}",
    "a.x3d": f"""<X3D version='3.3' profile='Interchange'><Scene><Shape>
<IndexedFaceSet coordIndex='0 1 2 -1'><Coordinate point='{CORNERS}'/></IndexedFaceSet>
</Shape></Scene></X3D>""",
    "a.obj": "v 0 0 0\nv 3 0 0\nv 0 4 0\nf 1 2 3\n",
    "a.stl": """solid a
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 3 0 0
vertex 0 4 0
endloop
endfacet
endsolid a
""",
    "a.ply": """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
3 0 0
0 4 0
3 0 1 2
""",
}


@pytest.mark.parametrize("name", sorted(TRIANGLES))
def test_every_format_opens_plain_and_gzipped(name: str, tmp_path: pathlib.Path) -> None:
    data = TRIANGLES[name].encode()
    (tmp_path / name).write_bytes(data)
    (tmp_path / f"{name}.gz").write_bytes(gzip.compress(data))
    for path in (tmp_path / name, tmp_path / f"{name}.gz"):
        found = ivcam.open(path).triangles()
        assert len(found.faces) == 1
        a, b, c = found.positions[found.faces[0]].astype(float)
        assert 0.5 * np.linalg.norm(np.cross(b - a, c - a)) == pytest.approx(6)


def test_problems_have_their_place_and_help() -> None:
    document = ivcam.open(b"#Inventor V2.1 ascii\nCube { widht 3 }\n", name="a.iv")
    (problem,) = document.problems[:1]
    assert (problem["file"], problem["line"]) == ("a.iv", 2)
    assert problem["column"] >= 1 and "widht" in problem["message"]


def test_a_scene_keeps_its_folders_and_its_file(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("scenes", "textures"):
        (tmp_path / folder).mkdir()
    (tmp_path / "textures" / "red.ppm").write_bytes(b"P6 1 1 255\n\xff\0\0")
    text = b"""#Inventor V2.1 ascii
PerspectiveCamera { position 0 0 5 } DirectionalLight { }
Texture2 { filename "red.ppm" } Cube { }"""
    (tmp_path / "scenes" / "red.iv").write_bytes(text)
    monkeypatch.chdir(tmp_path / "scenes")
    of_file = ivcam.open("red.iv", search=[tmp_path / "textures"])
    of_bytes = ivcam.open(text, search=["../textures"])
    monkeypatch.chdir(tmp_path)
    for document in (of_file, of_bytes):
        assert len(document.triangles().images) == 1
        picture = ivcam.render(document, lens="none", size=(20, 10), samples=1)
        red, green, _ = picture.pixels[5, 10]
        assert red > 0 and green == 0 and " --search " in picture.metadata["Command"]
    for name in ("scenes/red.iv", "textures/red.ppm"):
        with pytest.raises(ivcam.ArgumentError, match="would overwrite the input"):
            of_file.convert(name, format="inventor")
    with pytest.raises(ivcam.ArgumentError, match="would overwrite the input"):
        ivcam.render(of_file, report="scenes/red.iv")
    assert (tmp_path / "scenes" / "red.iv").read_bytes() == text


def test_a_file_with_the_name_of_standard_input_is_a_file(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ivcam.NotFoundError):
        ivcam.open("-")
    (tmp_path / "-").write_bytes(SCENE)
    assert len(ivcam.open("-").nodes) == len(ivcam.open(SCENE).nodes)


def test_dead_files_are_exceptions_by_kind(tmp_path: pathlib.Path) -> None:
    with pytest.raises(ivcam.IvcamError) as missing:
        ivcam.open(tmp_path / "gone.iv")
    assert "gone.iv" in str(missing.value)
    assert isinstance(missing.value, (ivcam.NotFoundError, ivcam.FileError))
    (tmp_path / "text.iv").write_bytes(b"nothing of a scene")
    with pytest.raises(ivcam.IvcamError):
        ivcam.open(tmp_path / "text.iv")
    with pytest.raises(ivcam.IvcamError):
        ivcam.open(b"\x1f\x8b\x08\x00dead")
    with pytest.raises(TypeError):
        ivcam.open(b"#Inventor V2.1 ascii\n", contain=".")


def test_a_folder_is_checked(scene: pathlib.Path) -> None:
    (scene.parent / "dead.wrl").write_bytes(b"nothing")
    records = {pathlib.Path(r["file"]).name: r for r in ivcam.check(scene.parent)}
    assert records["ball.iv"]["state"] == "whole" and records["ball.iv"]["nodes"] > 6
    assert records["dead.wrl"]["state"] == "unreadable"
    with pytest.raises(ivcam.NotFoundError):
        empty = scene.parent / "empty"
        empty.mkdir()
        ivcam.check(empty)
