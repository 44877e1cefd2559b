# mrcal on a campaign that tests/benchmark/mrcal_peer.cc wrote. After "prior": prints what its regularisation says of the
# lens parameters, a line of camera, parameter, mean and sigma for each. After "solve": prints the seconds of the solve
# alone and half the sum of squares at its optimum, regularisation included. There is no outlier rejection.
# After "uncertainty": takes the state as solved, with observations of 1 px, and prints the seconds that its map of the
# projection uncertainty takes, from the problem in memory; then the map, four numbers a cell.
import sys
import time

import mrcal
import numpy as np

task, folder = sys.argv[1].split(":")
folder += "/"
cameras, boards, corners, estimate_warp = np.fromfile(folder + "sizes", dtype=np.int64)
read = lambda name, *shape: np.fromfile(folder + name).reshape(*shape)
views = boards * cameras
observations = np.ones((views, corners, corners, 3))
observations[..., :2] = read("pixels", views, corners, corners, 2)
indices = np.array([(b, c, c - 1) for b in range(boards) for c in range(cameras)], dtype=np.int32)
lenses = read("lenses", cameras, -1)
problem = dict(
    intrinsics=lenses,
    extrinsics_rt_fromref=read("mounts", cameras, 6)[1:] if cameras > 1 else None,
    frames_rt_toref=read("placements", boards, 6),
    points=None,
    observations_board=observations,
    indices_frame_camintrinsics_camextrinsics=indices,
    observations_point=None,
    indices_point_camintrinsics_camextrinsics=None,
    lensmodel=f"LENSMODEL_OPENCV{lenses.shape[1] - 4}",
    imagersizes=np.tile(np.array((4000, 2200), dtype=np.int32), (cameras, 1)),
    calobject_warp=read("warp", 2) if estimate_warp else None,
    do_optimize_intrinsics_core=True,
    do_optimize_intrinsics_distortions=True,
    do_optimize_extrinsics=True,
    do_optimize_frames=True,
    do_optimize_calobject_warp=bool(estimate_warp),
    calibration_object_spacing=0.9 / (corners - 1),
    do_apply_outlier_rejection=False,
    do_apply_regularization=True,
    verbose=False,
)
if task == "prior":
    packed, x, jacobian, _ = mrcal.optimizer_callback(no_factorization=True, **problem)
    scale = np.ones(packed.shape)
    mrcal.unpack_state(scale, **problem)
    first = mrcal.measurement_index_regularization(**problem)
    for row in range(first, first + mrcal.num_measurements_regularization(**problem)):
        entry = jacobian[row]
        column, slope = entry.indices[0], entry.data[0] / scale[entry.indices[0]]
        value = packed[column] * scale[column]
        print(*divmod(column, lenses.shape[1]), repr(float(value - x[row] / slope)), repr(float(1 / abs(slope))))
elif task == "uncertainty":
    camera, columns, rows, distance, problem["do_apply_regularization"] = read("request", 5)
    model = mrcal.cameramodel(optimization_inputs=problem, icam_intrinsics=int(camera))
    model.optimization_inputs = lambda: problem  # not unpacked from a file's text
    start = time.perf_counter()
    pixels = mrcal.sample_imager(int(columns), int(rows), *model.imagersize())
    rays = mrcal.unproject(pixels, *model.intrinsics(), normalize=True)
    infinite = not np.isfinite(distance)
    covariances = mrcal.projection_uncertainty(
        rays if infinite else rays * distance,
        model,
        atinfinity=infinite,
        what="covariance",
        observed_pixel_uncertainty=1,
    )
    print(time.perf_counter() - start)
    print(*map(repr, covariances.ravel().tolist()))
else:
    start = time.perf_counter()
    solved = mrcal.optimize(**problem)
    print(time.perf_counter() - start, repr(0.5 * float(np.dot(solved["x"], solved["x"]))))
