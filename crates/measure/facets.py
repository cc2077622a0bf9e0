"""Phong's values as facets, by the formulas of docs/guide/shading.md, for `mitsuba_paths.py`.

The surface is that of a ball under a point light, seen by the camera of the other scenes. The
density of the facets and Smith's function are compared with Mitsuba's `MicrofacetDistribution`
before they are used; Mitsuba's surfaces have the same two, but separable shadowing and no light
that facets reflect several times. It holds for reflectances of at least 2% at normal incidence.
"""

import math

import mitsuba as mi
import numpy as np

# The intervals of the quadrature of an albedo by slope and by turn, and of the table of albedos.
SLOPES, TURNS, COSINES = 400, 128, 96


def dot(a, b):
    return np.sum(a * b, axis=-1)


class Facets:
    """The scattering of a surface by its diffuse color, specular color and shininess."""

    def __init__(self, diffuse, specular, shininess):
        self.alpha = math.sqrt(2 / (128 * shininess + 2))
        self.rho, self.f0 = np.array(diffuse), np.array(specular)
        self.compare_with_mitsuba()
        self.roots = np.linspace(0, 1, COSINES + 1)
        self.table = np.array([self.integrate(max(root * root, 1e-5)) for root in self.roots])
        self.mean_single = self.mean(self.table[:, 0])
        # The mean of Schlick's factor over the hemisphere.
        fresnel = self.f0 + (1 - self.f0) / 21
        self.several = fresnel ** 2 * self.mean_single / (1 - fresnel * (1 - self.mean_single))
        self.mean_layer = np.array([self.mean(values) for values in self.layer(*self.table.T).T])

    def density(self, cosine):
        a = self.alpha ** 2
        return a / (math.pi * (cosine * cosine * (a - 1) + 1) ** 2)

    def smith(self, cosine):
        tangent2 = 1 / (cosine * cosine) - 1
        return (np.sqrt(1 + self.alpha ** 2 * tangent2) - 1) / 2

    def compare_with_mitsuba(self):
        facets, up = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha), [0.0, 0.0, 1.0]
        for cosine in np.linspace(0.02, 0.999, 200):
            w = [math.sqrt(1 - cosine * cosine), 0.0, float(cosine)]
            np.testing.assert_allclose(self.density(cosine), facets.eval(w), rtol=1e-4)
            np.testing.assert_allclose(1 / (1 + self.smith(cosine)), facets.smith_g1(w, up), rtol=1e-4)

    def mean(self, values):
        """2 ∫ E μ dμ of the values at the roots of the cosines μ, by the trapezoidal rule."""
        weighed = 4 * self.roots ** 3 * values
        return float(np.sum(weighed[1:] + weighed[:-1]) / 2 / COSINES)

    def integrate(self, cosine):
        """Returns the albedo of perfect mirrors and that of Schlick's growing part alone.

        The integral is over the facets, the tangents of whose slopes are α √(u/(1-u)) for u from 0
        to 1.
        """
        u, turn = ((np.arange(count) + 0.5) / count for count in (SLOPES, TURNS))
        u, turn = np.meshgrid(u, math.pi * turn, indexing="ij")
        tangent = self.alpha * np.sqrt(u / (1 - u))
        hz = 1 / np.sqrt(1 + tangent * tangent)
        oh = tangent * hz * np.cos(turn) * math.sqrt(1 - cosine * cosine) + hz * cosine
        iz = 2 * oh * hz - cosine
        there = (oh > 0) & (iz > 1e-9)
        shadow = 1 / (1 + self.smith(cosine) + self.smith(np.where(there, iz, 1)))
        weight = np.where(there, shadow * oh / (cosine * hz), 0)
        return np.mean(weight), np.mean(weight * (1 - np.clip(oh, 0, 1)) ** 5)

    def layer(self, single, edge):
        """The share of light that the facets send back, reflected once and several times."""
        single, edge = np.asarray(single)[..., None], np.asarray(edge)[..., None]
        return self.f0 * single + (1 - self.f0) * edge + (1 - single) * self.several

    def scatter(self, o, i, h):
        """The BRDF. Of `h`, one cosine is the normal's to the halfway vector, one that of `o` to it."""
        schlick = self.f0 + (1 - self.f0) * ((1 - h[1]) ** 5)[..., None]
        once = (self.density(h[0]) / (4 * o * i * (1 + self.smith(o) + self.smith(i))))[..., None] * schlick
        albedos = [[np.interp(np.sqrt(w), self.roots, column) for column in self.table.T] for w in (o, i)]
        (eo, edge_o), (ei, edge_i) = albedos
        several = ((1 - eo) * (1 - ei) / (math.pi * (1 - self.mean_single)))[..., None] * self.several
        below = (1 - self.layer(eo, edge_o)) * (1 - self.layer(ei, edge_i)) / (1 - self.mean_layer)
        return once + several + self.rho / math.pi * below


def picture(surface, ball, lamp, view, random, samples):
    """The radiance of a ball (center and radius) under a point light (place and intensity), at random
    points of each pixel.

    `view` has the distance of the camera on the z axis, its height angle, and width and height in
    pixels.
    """
    (center, radius), (place, intensity) = ball, lamp
    distance, angle, width, height = view
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    total = np.zeros((height, width, 3))
    for _ in range(samples):
        u, v = x + random.random(x.shape) - width / 2, height / 2 - y - random.random(x.shape)
        ray = np.stack([u, v, np.full(u.shape, -height / 2 / math.tan(angle / 2))], axis=-1)
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        from_center = np.array([0, 0, distance]) - center
        half = dot(ray, from_center)
        root = half * half - dot(from_center, from_center) + radius * radius
        point = from_center + (-half - np.sqrt(np.maximum(root, 0)))[..., None] * ray
        normal = point / radius
        toward = np.array(place) - center - point
        squared = dot(toward, toward)
        toward /= np.sqrt(squared)[..., None]
        halfway = toward - ray
        halfway /= np.linalg.norm(halfway, axis=-1, keepdims=True)
        o, i = -dot(ray, normal), dot(toward, normal)
        lit = (root > 0) & (i > 0) & (o > 0)
        o, i = np.where(lit, o, 1), np.where(lit, i, 1)
        light = surface.scatter(o, i, (dot(halfway, normal), dot(halfway, toward)))
        irradiance = i * math.pi * intensity / squared
        total += np.where(lit[..., None], light * irradiance[..., None], 0)
    return total / samples
