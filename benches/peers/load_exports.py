"""Do other programs read what `prehend export` writes? MuJoCo loads scenes, PyYAML the two YAML formats.

    pip install mujoco==4.0.0 pyyaml==6.0.3 numpy
    python load_exports.py FILE…      # .xml, .moveit.yaml, .isaac.yaml; one line a file, exit status 1 if one fails

Field names are those of moveit_msgs/Grasp (with trajectory_msgs/JointTrajectory, geometry_msgs/PoseStamped and
moveit_msgs/GripperTranslation) and of the isaac_grasp format, version 1.0, as published by their makers.
"""

import math
import sys

import mujoco
import numpy as np
import yaml

HEADER = {"frame_id": str}
VECTOR = {"x": float, "y": float, "z": float}
POINT = {
    "positions": [float],
    "velocities": [float],
    "accelerations": [float],
    "effort": [float],
    "time_from_start": {"sec": int, "nanosec": int},
}
TRAJECTORY = {"header": HEADER, "joint_names": [str], "points": [POINT]}
TRANSLATION = {"direction": {"header": HEADER, "vector": VECTOR}, "desired_distance": float, "min_distance": float}
GRASP = {
    "id": str,
    "pre_grasp_posture": TRAJECTORY,
    "grasp_posture": TRAJECTORY,
    "grasp_pose": {"header": HEADER, "pose": {"position": VECTOR, "orientation": {**VECTOR, "w": float}}},
    "grasp_quality": float,
    "pre_grasp_approach": TRANSLATION,
    "post_grasp_retreat": TRANSLATION,
    "post_place_retreat": TRANSLATION,
    "max_contact_force": float,
    "allowed_touch_objects": [str],
}
ISAAC = {"confidence": float, "position": [float], "orientation": {"w": float, "xyz": [float]}}


def fits(value, form, at):
    """Raises unless the value has the fields and types of the form, and no others."""
    if isinstance(form, dict):
        assert isinstance(value, dict) and value.keys() == form.keys(), f"{at}: {value} is not {list(form)}"
        for key, inner in form.items():
            fits(value[key], inner, f"{at}.{key}")
    elif isinstance(form, list):
        assert isinstance(value, list), f"{at}: {value} is no list"
        for k, item in enumerate(value):
            fits(item, form[0], f"{at}[{k}]")
    else:
        assert type(value) is form, f"{at}: {value!r} is no {form.__name__}"
        assert form is not float or math.isfinite(value), f"{at}: {value}"


def unit(q):
    assert abs(np.linalg.norm(q) - 1) < 1e-6, f"no unit quaternion: {q}"


def moveit(path):
    grasps = yaml.safe_load(open(path))
    fits(grasps, [GRASP], "")
    for grasp in grasps:
        unit([grasp["grasp_pose"]["pose"]["orientation"][k] for k in "xyzw"])
        for posture, n_points in (("pre_grasp_posture", 1), ("grasp_posture", 2)):
            names, points = grasp[posture]["joint_names"], grasp[posture]["points"]
            assert len(points) == n_points and all(len(p["positions"]) == len(p["effort"]) == len(names) for p in points)
    return f"{len(grasps)} grasps"


def isaac(path):
    file = yaml.safe_load(open(path))
    assert file["format"] == "isaac_grasp" and file["format_version"] == 1.0
    assert set(file) == {"format", "format_version", "object_frame_link", "gripper_frame_link", "grasps"}
    for name, grasp in file["grasps"].items():
        joints = {key: grasp.pop(key) for key in ("cspace_position", "pregrasp_cspace_position")}
        fits(grasp, ISAAC, name)
        unit([grasp["orientation"]["w"], *grasp["orientation"]["xyz"]])
        assert 0 <= grasp["confidence"] <= 1 and len(grasp["position"]) == 3
        for positions in joints.values():
            fits(positions, dict.fromkeys(positions, float), name)
        assert joints["cspace_position"].keys() == joints["pregrasp_cspace_position"].keys()
    return f"{len(file['grasps'])} grasps"


def mjcf(path):
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    deepest = min((c.dist for c in data.contact), default=0.0)
    assert np.isfinite(data.qacc).all()
    return f"{model.nu} servos, {model.npair} pairs, {data.ncon} contacts, deepest {-1000 * min(deepest, 0):.2f} mm"


def main():
    failed = 0
    for path in sys.argv[1:]:
        read = mjcf if path.endswith(".xml") else moveit if path.endswith(".moveit.yaml") else isaac
        try:
            print(f"{path}: {read(path)}")
        except Exception as error:
            failed += 1
            print(f"{path}: FAILED: {error}")
    sys.exit(1 if failed else 0)


main()
