"""Imports Inventor, VRML 1.0 and VRML97 scenes, and makes the camera a real lens."""

from . import importer, lens_camera


def register():
    importer.register()
    lens_camera.register()


def unregister():
    lens_camera.unregister()
    importer.unregister()
