"""Robots whose frames the ground holds, as Pinocchio's own solver of constraints moves them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from linkwise_runtime.quantities import Contact

from numeric.pinocchio_model import PinocchioModel


def standing_acceleration(own: PinocchioModel, contacts: Sequence[Contact], q: Any, qd: Any, tau: Any) -> Any:
    """Return qdd (n,) by `constraintDynamics`, for frames held at their origins: whole, or as points."""
    model, data = own.model, own.data
    models = pin.StdVec_RigidConstraintModel()
    state = own._state(q, qd, qd)
    pin.forwardKinematics(model, data, state[0])
    pin.updateFramePlacements(model, data)
    for contact in contacts:
        assert not any(contact.point)
        frame = model.frames[model.getFrameId(contact.frame)]
        kind = pin.PointAnchorConstraintModel if contact.kind == "point" else pin.FrameAnchorConstraintModel
        place = data.oMf[model.getFrameId(contact.frame)]
        anchor = kind(model, frame.parentJoint, frame.placement, 0, place)
        models.append(pin.convertToRigidConstraintModel(model, anchor, pin.LOCAL))
    datas = pin.StdVec_RigidConstraintData()
    datas.extend([one.createData() for one in models])
    pin.initConstraintDynamics(model, data, models, datas)
    back = np.linalg.inv(own.tie)
    settings = pin.ProximalSettings(1e-14, 1e-10, 200)
    return back @ pin.constraintDynamics(model, data, *state[:2], back.T @ tau, models, datas, settings)
