// Clouds as binary little-endian PLY.
//
// Vertex properties: double x y z (mm); float nx ny nz, intensity, sigma_mm, cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz
// (mm^2), quality; ushort station, view; float for each of the cloud's columns. Behind them the element `share`, where
// points were merged: uint point, ushort view, float weight. Comments state the schema, the frame, the
// units and the stations' ids in order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>

#include "recon/cloud.h"
#include "solvers/expected.h"

namespace crumple {

// Every bit survives, except that the covariance's lower triangle is not stored: it is the upper one mirrored, and that
// columns are not read again. Fails on a number that is not finite, and on a column that is not of every point.
Expected<void> write_cloud(const std::filesystem::path& file, const Cloud& cloud);

// Takes PLY files of others too: any scalar types in any order, further properties, and elements behind the vertices
// (a mesh's faces), which are ignored; what is missing keeps CloudPoint's default. Fails, naming the file, on ASCII and
// big-endian files, lists among the vertex properties, a file that is too short, a number that is not finite, a station
// without an id, and shares that are not ours.
Expected<Cloud> read_cloud(const std::filesystem::path& file);
// The same from a stream that holds `size` bytes; errors name no file.
Expected<Cloud> read_cloud(std::istream& stream, std::uintmax_t size);

}  // namespace crumple
