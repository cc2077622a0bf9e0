"""The extension in Blender without a window. Skipped where `bpy` is not installed."""

import pathlib
import sys

import pytest

bpy = pytest.importorskip("bpy", reason="bpy is not installed")
ivcam = pytest.importorskip("ivcam", reason="the package ivcam is not installed")
HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1]))

import check  # noqa: E402

SCENES = HERE.parents[2] / "scenes"
BALLS = """#VRML V2.0 utf8
Viewpoint { position 0 0 6 }
Transform { translation -1.5 0 0 children Shape { appearance Appearance {
  material Material { diffuseColor 1 0 0 } } geometry Sphere { } } }
Transform { translation 1 1 0 children Shape { appearance Appearance {
  material Material { diffuseColor 0 0 1 transparency 0.5 } } geometry Box { } } }
"""


CLEAR = """#VRML V2.0 utf8
DEF textured Transform { children Shape { appearance Appearance {
  material Material { transparency 0.7 } texture PixelTexture { image 1 1 3 0xFF0000 } }
  geometry Box { } } }
DEF replaced Transform { children Shape { appearance Appearance {
  material Material { transparency 0.7 } texture PixelTexture { image 1 1 4 0xFF000080 } }
  geometry Box { } } }
DEF opaque Transform { children Shape { appearance Appearance {
  material Material { } texture PixelTexture { image 1 1 3 0x00FF00 } } geometry Box { } } }
DEF plain Transform { children Shape { appearance Appearance {
  material Material { transparency 0.7 } } geometry Box { } } }
"""

REPEATED = """#VRML V2.0 utf8
Shape { geometry IndexedFaceSet { solid FALSE
  coord Coordinate { point [0 0 0, 1 0 0, 1 1 0, 0 1 0] }
  coordIndex [0 1 1 -1, 0 0 0 -1, 0 1 2 -1, 0 1 2 -1, 0 2 3 -1, 2 1 0 -1] } }
"""

GLOW = """#VRML V2.0 utf8
DirectionalLight { color 0.5 0.04 1 }
Shape { appearance Appearance { material Material { emissiveColor 0.5 0.04 1 } } geometry Box { } }
"""


@pytest.fixture(scope="module")
def extension():
    return check.extension()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["desk-lamp/desk-lamp.iv", "livroom/table.iv", "street/street.iv"])
def test_scenes_have_the_triangles_and_materials_of_ivcam(extension, name):
    ours, theirs = check.compare(SCENES / name)
    assert ours == theirs and ours[0] > 100


def test_objects_stand_where_the_scene_has_them(extension, tmp_path):
    path = tmp_path / "balls.wrl"
    path.write_text(BALLS)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.ops.import_scene.ivcam(filepath=str(path)) == {"FINISHED"}
    meshes = [one for one in bpy.data.objects if one.type == "MESH"]
    assert len(meshes) == 2
    middles = sorted(
        tuple(
            round(sum(v.co[i] for v in one.data.vertices) / len(one.data.vertices), 2)
            for i in range(3)
        )
        for one in meshes
    )
    # Inventor's y is Blender's z.
    assert middles[1] == pytest.approx((1, 0, 1), abs=0.05)
    assert middles[0] == pytest.approx((-1.5, 0, 0), abs=0.1)
    (camera,) = [one for one in bpy.data.objects if one.type == "CAMERA"]
    assert tuple(camera.location) == pytest.approx((0, -6, 0))


def test_a_texture_and_the_material_are_transparent_together(extension, tmp_path):
    path = tmp_path / "clear.wrl"
    path.write_text(CLEAR)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.ops.import_scene.ivcam(filepath=str(path)) == {"FINISHED"}
    opacity = {}
    for one in bpy.data.objects:
        if one.type != "MESH":
            continue
        (material,) = one.data.materials
        shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
        node = shader.inputs["Alpha"].links[0].from_node
        factors = [x.links[0].from_node.type for x in node.inputs if x.is_linked]
        color = shader.inputs["Base Color"].links[0].from_node.type
        name = one["ivcam_path"].split("/")[-1]
        opacity[name] = (node.type, *factors)
        alpha = one.data.color_attributes["Color"].data[0].color[3]
        assert color == ("VERTEX_COLOR" if name == "plain" else "TEX_IMAGE")
        assert alpha == pytest.approx(1.0 if name == "opaque" else 0.3)
    assert opacity == {
        "textured": ("MATH", "TEX_IMAGE", "VERTEX_COLOR"),
        "replaced": ("TEX_IMAGE",),  # By VRML97 its alpha counts alone.
        "opaque": ("TEX_IMAGE",),
        "plain": ("VERTEX_COLOR",),
    }


def test_meshes_keep_the_rules_of_blender(extension, tmp_path):
    path = tmp_path / "repeated.wrl"
    path.write_text(REPEATED)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    collection = bpy.data.collections.new("repeated")
    (made,), problems = extension.importer.import_scene(str(path), collection)
    faces = sorted(sorted(face.vertices) for face in made.data.polygons)
    assert len(faces) == 3 and faces[0] != faces[1] != faces[2]
    assert all(len(set(edge.vertices)) == 2 for edge in made.data.edges)
    assert not made.data.validate()
    (problem,) = problems
    assert "1 triangles that are there twice" in problem["message"]


def test_emission_and_lights_are_linear(extension, tmp_path):
    path = tmp_path / "glow.wrl"
    path.write_text(GLOW)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.ops.import_scene.ivcam(filepath=str(path)) == {"FINISHED"}
    (material,), (light,) = bpy.data.materials, bpy.data.lights
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    linear = pytest.approx((0.2140411, 0.0030960, 1.0), abs=1e-6)  # By IEC 61966-2-1.
    assert tuple(shader.inputs["Emission Color"].default_value)[:3] == linear
    assert tuple(light.color) == linear


def test_a_problem_of_a_binary_file_has_its_byte(extension):
    data = ivcam.open(b"#Inventor V2.1 ascii\nSphere { radius 2 }\n").to_bytes(binary=True)
    (problem,) = ivcam.open(data.replace(b"radius", b"radiuz")).problems[:1]
    assert extension.importer._where(problem) == f"byte {problem['byte']}: "
    (problem,) = ivcam.open(b"#Inventor V2.1 ascii\nSphere { radiuz 2 }\n").problems[:1]
    assert extension.importer._where(problem) == "line 2: "


def test_a_dead_file_is_an_error_and_leaves_nothing(extension, tmp_path):
    path = tmp_path / "dead.wrl"
    path.write_text("Dear archive,")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with pytest.raises(RuntimeError, match="dead.wrl"):
        bpy.ops.import_scene.ivcam(filepath=str(path))
    assert not bpy.data.collections and not bpy.data.objects


def test_a_camera_becomes_a_lens(extension):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    camera = bpy.data.cameras.new("Camera")
    scene = bpy.context.scene
    lens = extension.lens_camera.use_lens(camera, scene, name="biogon", efl=21, focus=2.0)
    assert lens.efl == pytest.approx(21)
    assert camera.type == "CUSTOM" and scene.render.engine == "CYCLES"
    assert camera.custom_bytecode and camera.cycles_custom["film_width"] == pytest.approx(36)
    assert scene.render.resolution_y == round(scene.render.resolution_x * 24 / 36)


def test_the_panel_chooses_a_lens(extension):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    camera = bpy.data.cameras.new("Camera")
    camera.ivcam_lens.lens = "tessar"
    camera.ivcam_lens.efl = 35
    with bpy.context.temp_override(camera=camera):
        assert bpy.ops.camera.ivcam_use_lens() == {"FINISHED"}
    assert "lens tessar" in camera.custom_shader.as_string()
    camera.ivcam_lens.focus = 0.001
    with bpy.context.temp_override(camera=camera), pytest.raises(RuntimeError, match="focal point"):
        bpy.ops.camera.ivcam_use_lens()
