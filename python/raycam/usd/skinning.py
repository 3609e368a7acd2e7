"""Skeletons and blend shapes of USD: deformed points. Source: the schemas of `UsdSkel`."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from .faces import Faces

__all__ = ["Skinning"]

EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


class Skinning:
    """The skinned prims of a stage at a time."""

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, places: UsdGeom.XformCache) -> None:
        self.moves = False
        self._time = time
        self._places = places
        self._cache = UsdSkel.Cache()
        self._bound: dict[Any, tuple[UsdSkel.SkeletonQuery, UsdSkel.SkinningQuery, Usd.Prim]] = {}
        for prim in Usd.PrimRange.Stage(stage, EVERYTHING) if _has_skeletons(stage) else ():
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, EVERYTHING)
            for binding in self._cache.ComputeSkelBindings(root, EVERYTHING):
                skeleton = self._cache.GetSkelQuery(binding.GetSkeleton())
                if not skeleton:
                    continue
                self.moves = self.moves or _animated(skeleton)
                for target in binding.GetSkinningTargets():
                    # Instances share the queries of their prototype, but not the skeleton's transform.
                    self._bound[target.GetPrim().GetPath()] = (
                        skeleton,
                        target,
                        binding.GetSkeleton().GetPrim(),
                    )

    def __contains__(self, prim: Usd.Prim) -> bool:
        """True for a prim that a skeleton or blend shapes deform."""
        return prim.GetPath() in self._bound

    def points(self, prim: Usd.Prim, points: Any) -> Any:
        """The deformed points [n, 3] of a prim, in its own coordinates.

        Raises `ValueError` for invalid weights.
        """
        skeleton, target, bones = self._bound[prim.GetPath()]
        moved = Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32))
        animation = skeleton.GetAnimQuery()
        if target.HasBlendShapes() and animation:
            moved = self._blended(prim, target, animation, moved)
        if not target.HasJointInfluences():
            return np.array(moved, np.float32).reshape(-1, 3)
        transforms = skeleton.ComputeSkinningTransforms(self._time)
        skeleton_place = self._places.GetLocalToWorldTransform(bones)
        to_local = skeleton_place * self._places.GetLocalToWorldTransform(prim).GetInverse()
        if target.IsRigidlyDeformed():
            matrix = target.ComputeSkinnedTransform(transforms, self._time)
            if matrix is None:
                raise ValueError("the skin weights do not match the skeleton")
            return _transformed(moved, Gf.Matrix4d(matrix) * to_local)
        if not target.ComputeSkinnedPoints(transforms, moved, self._time):
            raise ValueError("the skin weights do not match the points or the skeleton")
        return _transformed(moved, to_local)

    def normals(self, prim: Usd.Prim, normals: Any, faces: Faces) -> Any:
        """The normals [corners, 3] of a prim, rotated by its joints."""
        skeleton, target, bones = self._bound[prim.GetPath()]
        influences = None
        if target.HasJointInfluences():
            influences = target.ComputeVaryingJointInfluences(len(faces.points), self._time)
        if not influences:
            return normals
        joints, weights = (np.array(table).reshape(len(faces.points), -1) for table in influences)
        transforms = np.array(skeleton.ComputeSkinningTransforms(self._time))
        if own := target.GetJointOrder():
            joint_of = {joint: number for number, joint in enumerate(skeleton.GetJointOrder())}
            transforms = transforms[[joint_of.get(joint, 0) for joint in own]]
        place = self._places.GetLocalToWorldTransform(bones)
        to_local = np.array(place * self._places.GetLocalToWorldTransform(prim).GetInverse())
        local_from_bound = np.array(target.GetGeomBindTransform(self._time)) @ transforms @ to_local
        # Vectors are rows: a normal is multiplied by the transposed inverse.
        turns = np.linalg.pinv(local_from_bound[:, :3, :3]).transpose(0, 2, 1)
        turned = np.zeros((len(normals), 3))
        for joint, weight in zip(joints[faces.indices].T, weights[faces.indices].T, strict=True):
            turned += weight[:, None] * np.einsum("ni,nij->nj", normals, turns[joint])
        lengths = np.linalg.norm(turned, axis=1, keepdims=True)
        return np.where(lengths > 0, turned / np.maximum(lengths, 1e-30), normals).astype(np.float32)

    def _blended(self, prim: Usd.Prim, target: Any, animation: Any, points: Any) -> Any:
        """The points moved by blend shapes."""
        weights = animation.ComputeBlendShapeWeights(self._time)
        mapper = target.GetBlendShapeMapper()
        if mapper:
            weights = mapper.Remap(weights)
        query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        shares, shapes, parts = query.ComputeSubShapeWeights(weights)
        indices, offsets = query.ComputeBlendShapePointIndices(), query.ComputeSubShapePointOffsets()
        if not query.ComputeDeformedPoints(shares, shapes, parts, indices, offsets, points):
            raise ValueError("the blend shapes do not match the points")
        return points


def _has_skeletons(stage: Usd.Stage) -> bool:
    """True if a prim or a prototype is a `SkelRoot`; each prototype is searched once."""
    ranges = [
        Usd.PrimRange.Stage(stage, Usd.PrimDefaultPredicate),
        *map(Usd.PrimRange, stage.GetPrototypes()),
    ]
    return any(prim.IsA(UsdSkel.Root) for prims in ranges for prim in prims)


def _animated(skeleton: UsdSkel.SkeletonQuery) -> bool:
    query = skeleton.GetAnimQuery()
    return bool(query) and (
        query.JointTransformsMightBeTimeVarying() or query.BlendShapeWeightsMightBeTimeVarying()
    )


def _transformed(points: Any, matrix: Gf.Matrix4d) -> Any:
    table = np.array(matrix)
    return (np.array(points, float).reshape(-1, 3) @ table[:3, :3] + table[3, :3]).astype(np.float32)
