"""Codes of notices and errors, with their causes and remedies."""

from __future__ import annotations

from typing import NamedTuple

from . import _core

__all__ = ["ERRORS", "NOTICES", "Code"]


class Code(NamedTuple):
    """Cause and remedy of a code, as sentences."""

    cause: str
    remedy: str


_OWN_NOTICES = {
    "no_poses": Code(
        "MuJoCo's data contains no poses of bodies yet, so the images are empty.",
        "Call mujoco.mj_forward(model, data) before update_scene.",
    ),
    "assumed_up_axis": Code(
        "Mesh files do not specify their up axis: z is assumed, or y for an OBJ file that the command line or a view "
        "opens.",
        "If the model lies on its side, click the button for the up axis in the view, or load it with up= (--up).",
    ),
    "studio": Code(
        "The world has no lights, and its camera is placed by raycam, so it is shown in a studio.",
        "Add lights or a camera to the world to replace the studio.",
    ),
    "shadow_catchers_visible": Code(
        "Shadow catchers appear as ordinary surfaces in this image.",
        "Render with transparent_background=True or a background to show only their shadows.",
    ),
    "no_caught_shadows": Code(
        "Emissive objects are the only light, so shadow catchers show no shadows.",
        "Add a light to the world.",
    ),
    "unposed_camera": Code(
        "The camera is at the origin, inside the world, because its file contains no pose.",
        "Give the camera a pose, or place it with world.view_from.",
    ),
    "nothing_visible": Code(
        "No object covers the centre of a pixel.",
        "Move the camera; world.view_from shows the whole world.",
    ),
    "nothing_lit": Code(
        "The visible objects are black because no light reaches them or because their materials reflect no light.",
        "Check the positions and directions of the lights, and the colours of the materials.",
    ),
    "overexposed": Code(
        "Almost all of the objects' pixels are brighter than white.",
        "Lower the exposure or the strength of the lights.",
    ),
    "no_shading": Code(
        "All of the objects' pixels are displayed in one or two colours, although their brightness differs.",
        "Use the exposure that the notice recommends.",
    ),
    "fireflies": Code(
        "Some pixels are far brighter than their neighbours because of a single light path.",
        "Use more samples, larger lights, denoise=True, or clamp (which darkens the image).",
    ),
    "denoised": Code(
        "The image was denoised, so it is an estimate and no longer unbiased.",
        "Render without denoise for an unbiased image.",
    ),
    "chosen_world": Code(
        "A folder or an archive contains several worlds or models, and one of them is shown.",
        "Pass the paths of the files to show.",
    ),
    "watch_limit": Code(
        "The folder contains too many files, so only some of them are watched for changes.",
        "Put the world and its files into a separate folder.",
    ),
    "applied_orientation": Code(
        "A photo was rotated by its EXIF orientation, because only the rotated photo has its camera's shape.",
        'Pass orientation="ignore" if the camera belongs to the pixels as they are stored.',
    ),
    "resampled_background": Code(
        "The background does not have the size of the image and was resampled or cropped.",
        "Use a background of the image's size, or a raycam.Background with its own camera.",
    ),
    "uncovered_background": Code(
        "Part of the image is outside the background photo and is black.",
        "Use a photo with a wider field of view.",
    ),
    "rounded_values": Code(
        "The file stores values with fewer digits than the frame has.",
        "Save as .npz or .exr for exact values.",
    ),
    "default_video": Code(
        "The world has no [video], so the camera orbits its centre for 4 seconds.",
        "Add a [video] section to the world file.",
    ),
    "varying_samples": Code(
        "The number of samples per pixel depends on the speed of the machine.",
        "Use samples instead of time_limit for reproducible frames.",
    ),
    "outside_times": Code(
        "Times are before the beginning or after the end of the world's motion.",
        "Use times within the duration of its video or animations.",
    ),
    "unused_times": Code(
        "The times of rays have no effect, because no time is set for the animated world.",
        "Cast the rays in world.at(time).",
    ),
    "overlapping_objects": Code(
        "A robot's link overlaps another object.",
        "Move the robot or the object, or change the robot's joints.",
    ),
    "xacro_warning": Code(
        "xacro printed a warning while it expanded a robot's file.",
        "Correct the file; the notice contains the warning.",
    ),
    "outside_limits": Code(
        "Joint values of a robot are beyond the limits of its file.",
        "Correct the values, or clamp them with clamp_joints=True.",
    ),
    "values_lost": Code(
        "A data set's format cannot represent some values.",
        "Use another format, or another depth_scale.",
    ),
    "damaged_results": Code(
        "Results of an earlier run were damaged, and the frames are rendered again.",
        "Check the disk if this happens again.",
    ),
    "missing_locks": Code(
        "The file system does not support locks.",
        "Let only one process at a time work in this folder.",
    ),
    "insecure_cluster": Code(
        "The connection to the Dask scheduler is neither encrypted nor authenticated.",
        "Use a tls:// address or a private network.",
    ),
    "unusable_worker": Code(
        "A worker cannot render frames, or fewer workers than requested were started.",
        "Install the same version of raycam on the worker; the message states the reason.",
    ),
    "waiting_for_workers": Code(
        "A cluster has no workers yet.",
        "Start workers, or check that they reach the scheduler.",
    ),
    "differing_frames": Code(
        "The compared frames come from different cameras, worlds or regions.",
        "Compare frames of the same camera and world.",
    ),
    "generic_angles": Code(
        "A lidar uses the angles of its model, or a substitute pattern, because the unit's own are unknown.",
        "Load the unit's calibration with raycam.load_lidar.",
    ),
    "assumed_device": Code(
        "A calibration's device is unknown, so values that the file does not contain are those of another device.",
        "Pass a device, or the values as settings.",
    ),
    "assumed_reflectance": Code(
        "Coloured materials have no reflectance at a lidar's wavelength, so their red channel was used.",
        "Set the red channel of the materials' colours to their reflectance at this wavelength.",
    ),
    "empty_scan": Code(
        "A scan has no points.",
        "Check the lidar's pose and range limits; the notice lists the reasons for lost pulses.",
    ),
    "preview_light": Code(
        "A frame saved from the live view was lit by the integrator that the message names.",
        "To use another integrator, render the image with raycam.render.",
    ),
    "misplaced_mesh": Code(
        "The mesh's unit or coordinate frame seems to differ from that of the cameras.",
        "Put the mesh into the cameras' coordinates; the message contains the scale that fits best.",
    ),
    "inside_out_mesh": Code(
        "Most rays hit the backs of faces, so both sides of the faces count as visible.",
        "Flip the mesh's faces.",
    ),
    "overlapping_islands": Code(
        "Several faces share the same texels, because islands of the texture coordinates overlap.",
        "Unwrap the mesh without overlaps.",
    ),
    "faces_without_texels": Code(
        "Faces have no texels, because xatlas did not unwrap them.",
        'Use atlas="cells", or repair the mesh.',
    ),
    "missed_source": Code(
        "Texels have no surface of the source near them, and show the baked object itself.",
        "Enlarge the cage, or check that both models have the same position and size.",
    ),
    "coarse_texture": Code(
        "The photographs show more detail than the texture can hold.",
        "Use the size that the message contains.",
    ),
    "misaligned_photographs": Code(
        "Photographs are shifted relative to the other photographs, so their poses or lenses seem to be wrong.",
        "Improve the poses of the photographs, or remove them.",
    ),
}

_OWN_ERRORS = {
    "invalid_job": Code(
        "A job's folder cannot be used.",
        "Use another folder, or correct the problem that the message describes.",
    ),
    "damaged_job": Code(
        "Files of a job or its results are damaged, or another program has changed them.",
        "Remove the file that the message names and repeat the job's command; finished frames are kept.",
    ),
    "changed_input": Code(
        "A job's worlds, cameras or options have changed since the job began.",
        "Restore them, or start a new job in another folder.",
    ),
    "failed_frames": Code(
        "Frames of a job have failed.",
        "Read the log that the message names; retry_failed=True renders the frames again.",
    ),
    "folder_in_use": Code(
        "Another process works in the same folder.",
        "Wait for it, stop it, or give each process its part with shard=(I, N).",
    ),
    "no_poses": Code(
        "The state of a MuJoCo model has no poses, because MuJoCo has not computed them yet.",
        "Call `mujoco.mj_forward(model, data)` first.",
    ),
    "no_volume": Code(
        "An object that should fall encloses no volume.",
        "Use a closed mesh that encloses a volume.",
    ),
    "not_settled": Code(
        "The falling objects did not come to rest inside their target without penetrating each other.",
        "Use fewer objects, a larger target, more time or another seed.",
    ),
    "missing_camera": Code(
        "A rig has only lidars, but an image or the data set's format requires a camera.",
        "Mount a camera on the rig, or use a format for lidars (semantickitti, nuscenes, mcap) or raycam scan.",
    ),
    "unsupported_camera": Code(
        "The camera's lens, skew, motion or parallel rays are not supported here.",
        "Convert the camera with pinhole(), undistorted() or still().",
    ),
    "workers_lost": Code(
        "The connection to a job's workers was lost.",
        "Start the workers again and repeat the command; finished frames are kept.",
    ),
    "cluster_unreachable": Code(
        "No Dask scheduler answers at the address, or the scheduler has stopped.",
        "Start the scheduler, and check the address and the network.",
    ),
    "cannot_listen": Code(
        "The live view cannot use the requested address or port.",
        "Use another port, or omit it for the next free one.",
    ),
    "read_only": Code(
        "An object, list or view that is read-only was changed.",
        "Use the method that the message names; a view is started with edit=True.",
    ),
    "nothing_to_undo": Code(
        "There is no edit to undo or redo.",
        "No action is needed.",
    ),
    "no_samples": Code(
        "The image of the live view has no samples yet.",
        "Save it when the view is at rest.",
    ),
    "changed_file": Code(
        "A world file, or a file that it names, has changed since it was opened.",
        "Open the file again, or save the world as GLB.",
    ),
    "failed_command": Code(
        "A command of raycam demo failed.",
        "Read the error that the command printed.",
    ),
    "failed_selftest": Code(
        "The installed renderer returns results that differ from the reference renderer's.",
        "Reinstall raycam, and report the output of raycam doctor if the test fails again.",
    ),
    "photograph_size": Code(
        "A photograph does not have its camera's size.",
        "Use the photographs that the cameras belong to, or resize the cameras with --size.",
    ),
    "missing_photograph": Code(
        "A mapping of photographs lacks the name of a camera's photograph.",
        "Add it, or remove the camera.",
    ),
    "missing_texture_coordinates": Code(
        "The object has no texture coordinates.",
        'Unwrap it with atlas="xatlas" (--atlas xatlas), or in another program such as Blender.',
    ),
    "invalid_lidar": Code(
        "The settings of a lidar are invalid.",
        "Use a device of this package, raycam.load_lidar or raycam.Lidar.of.",
    ),
    "unsupported_rate": Code(
        "A lidar does not support this rate.",
        "Use a supported rate, or pass force_rate=True (--force-rate).",
    ),
    "wrong_device": Code(
        "A calibration file or an operation requires a different lidar.",
        "Use a device that the message names, or the calibration file of this device.",
    ),
    "unordered_times": Code(
        "The times of pulses, poses or joint states do not increase.",
        "Sort the rows by time.",
    ),
    "failed_process": Code(
        "The separate process that reads a file failed.",
        "Repair or simplify the file; the message contains the end of the process's output.",
    ),
    "failed_denoising": Code(
        "Open Image Denoise returned an error.",
        "Reinstall pyoidn, or render without denoise.",
    ),
    "not_a_tree": Code(
        "The links of a robot do not form a tree with one root.",
        "Connect each link except the root to one parent by one joint.",
    ),
    "unfinished_job": Code(
        "A job has not finished all its frames or tiles.",
        "Run the job again until it is finished.",
    ),
    "unimportable_class": Code(
        "The class of a sensor cannot be imported by a worker or on this machine.",
        "Define the class in an importable module, with the class method from_dict.",
    ),
    "insecure_address": Code(
        "The address would make an unencrypted live view available to other people.",
        "Forward the port with ssh, or add --yes.",
    ),
    "unsupported_version": Code(
        "An object comes from a version of another package that is not supported.",
        "Upgrade the package to the version that the message states, and create the object again.",
    ),
    "missing_dependency": Code(
        "An optional package is not installed.",
        "Install the extra that the message names, such as raycam[usd].",
    ),
}


def _table(core: list[list[str]], own: dict[str, Code]) -> dict[str, Code]:
    return {name: Code(cause, remedy) for name, cause, remedy in core} | own


_CORE_NOTICES, _CORE_ERRORS = _core.codes()
NOTICES = _table(_CORE_NOTICES, _OWN_NOTICES)
"""Every `code` of a `raycam.Notice`."""
ERRORS = _table(_CORE_ERRORS, _OWN_ERRORS)
"""Every `code` of a `raycam.Error`, and of the `OSError` of a file and the `MemoryError` that raycam raises."""
