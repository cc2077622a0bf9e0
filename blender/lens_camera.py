"""A panel of the camera that makes it a real lens, by the shader that `ivcam` exports.

Cycles traces the rays of such a camera through the surfaces of the lens, so distortion, vignetting and
blur are those of the lens. It needs Blender 4.5 or later with Cycles and the Open Shading Language.
"""

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, PointerProperty

import ivcam


def _lenses(_self, _context):
    return _LENSES


#: Blender keeps no reference to the texts of a list, so this one has to stay.
_LENSES = [(name, name, "") for name in ivcam.lenses()]


class IvcamLens(bpy.types.PropertyGroup):
    """The lens of a camera."""

    lens: EnumProperty(name="Lens", items=_lenses)
    efl: FloatProperty(
        name="Focal Length",
        description="Millimeters; 0 leaves the lens as it is",
        min=0,
        default=50,
    )
    f_number: FloatProperty(name="F-Number", description="0 leaves the iris open", min=0, default=0)
    focus: FloatProperty(
        name="Focus", description="Meters from the front vertex; 0 is infinity", min=0, default=2
    )
    film: FloatVectorProperty(name="Film (mm)", size=2, min=0.1, default=(36.0, 24.0))


def use_lens(camera, scene, *, name, efl=None, f_number=None, focus=None, film=(36.0, 24.0)):
    """Makes a camera a lens, and gives the render the shape of the film.

    Args:
        camera: the data of a camera.
        efl: millimeters. f_number: the working aperture. focus: meters, `None` for infinity.

    Raises:
        ivcam.IvcamError: the lens cannot be opened or focused, or the shader does not have it.
    """
    lens = ivcam.Lens(name, efl=efl, f_number=f_number, focus="inf" if focus is None else focus)
    text = bpy.data.texts.new(f"{name}.osl")
    text.write(lens.export("osl", film=tuple(film)))
    render = scene.render
    render.engine = "CYCLES"
    scene.cycles.shading_system = True
    render.resolution_y = max(1, round(render.resolution_x * film[1] / film[0]))
    camera.type = "CUSTOM"
    camera.custom_mode = "INTERNAL"
    camera.custom_shader = text
    return lens


class IVCAM_OT_use_lens(bpy.types.Operator):
    """Makes the camera this lens, rendered by Cycles"""

    bl_idname = "camera.ivcam_use_lens"
    bl_label = "Use Lens"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return getattr(context, "camera", None) is not None

    def execute(self, context):
        chosen = context.camera.ivcam_lens
        try:
            lens = use_lens(
                context.camera,
                context.scene,
                name=chosen.lens,
                efl=chosen.efl or None,
                f_number=chosen.f_number or None,
                focus=chosen.focus or None,
                film=chosen.film,
            )
        except ivcam.IvcamError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{lens.name}: {lens.efl:.2f} mm, f/{lens.f_number:.2f}")
        return {"FINISHED"}


class IVCAM_PT_lens(bpy.types.Panel):
    bl_label = "Real Lens"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context):
        return context.camera is not None

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        chosen = context.camera.ivcam_lens
        for name in ("lens", "efl", "f_number", "focus", "film"):
            layout.prop(chosen, name)
        layout.operator(IVCAM_OT_use_lens.bl_idname)


CLASSES = (IvcamLens, IVCAM_OT_use_lens, IVCAM_PT_lens)


def register():
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Camera.ivcam_lens = PointerProperty(type=IvcamLens)


def unregister():
    del bpy.types.Camera.ivcam_lens
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
