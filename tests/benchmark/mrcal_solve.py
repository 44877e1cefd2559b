# One solve by mrcal of a campaign that tests/benchmark/mrcal_peer.cc wrote: prints the seconds of the solve alone and
# half the sum of squares at its optimum. Regularisation and outlier rejection are off, as in the solve beside it.
import sys
import time

import mrcal
import numpy as np

folder = sys.argv[1] + "/"
cameras, boards, corners, estimate_warp = np.fromfile(folder + "sizes", dtype=np.int64)
read = lambda name, *shape: np.fromfile(folder + name).reshape(*shape)
views = boards * cameras
observations = np.ones((views, corners, corners, 3))
observations[..., :2] = read("pixels", views, corners, corners, 2)
indices = np.array([(b, c, c - 1) for b in range(boards) for c in range(cameras)], dtype=np.int32)
problem = dict(
    intrinsics=read("lenses", cameras, 12),
    extrinsics_rt_fromref=read("mounts", cameras, 6)[1:] if cameras > 1 else None,
    frames_rt_toref=read("placements", boards, 6),
    points=None,
    observations_board=observations,
    indices_frame_camintrinsics_camextrinsics=indices,
    observations_point=None,
    indices_point_camintrinsics_camextrinsics=None,
    lensmodel="LENSMODEL_OPENCV8",
    imagersizes=np.tile(np.array((4000, 2200), dtype=np.int32), (cameras, 1)),
    calobject_warp=np.zeros(2) if estimate_warp else None,
    do_optimize_intrinsics_core=True,
    do_optimize_intrinsics_distortions=True,
    do_optimize_extrinsics=True,
    do_optimize_frames=True,
    do_optimize_calobject_warp=bool(estimate_warp),
    calibration_object_spacing=0.9 / (corners - 1),
    do_apply_outlier_rejection=False,
    do_apply_regularization=False,
    verbose=False,
)
start = time.perf_counter()
solved = mrcal.optimize(**problem)
print(time.perf_counter() - start, repr(0.5 * float(np.dot(solved["x"], solved["x"]))))
