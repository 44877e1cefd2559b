// A calibration's report.html against its summary.json.
#pragma once

#include <string>

#include "tests/python.h"

namespace crumple {

// Reading it as XML is the strictest reading.
inline constexpr const char* kCheckReport = R"(
import json, re, sys
import xml.etree.ElementTree as tree
folder = sys.argv[1]
text = open(folder + "/report.html", encoding="utf-8").read()
root = tree.fromstring(text)
name = lambda element: element.tag.split("}")[-1]
ids = [e.get("id") for e in root.iter() if e.get("id")]
print("".join("twice: %s\n" % i for i in set(ids) if ids.count(i) > 1), end="")
for e in root.iter():
    if name(e) in ("script", "iframe", "object", "link", "img"): print("an element that is not to be:", name(e))
    for key, value in e.attrib.items():
        if name(e) == "path": continue
        if key.split("}")[-1] in ("href", "src") and not value.startswith(("#", "data:image/png;base64,")):
            print("refers to", value)
        if key.startswith("on"): print("a script:", key)
if re.search(r"url\((?!#)|@import", text): print("the style loads something")
if len(text) > 2000000: print("larger than 2 MB:", len(text))

summary = json.load(open(folder + "/summary.json"))
section = {e.get("id"): e for e in root.iter() if name(e) == "section"}
for id in ("capture", "budget", "noise", "patterns", "sensors", "volume", "correlations", "rig", "inputs"):
    if id not in section: print("no section", id)
for id in ("rig", "sensors"):
    if not any(name(e) in ("svg", "img", "image") for e in section[id].iter()): print("no drawing in", id)
def rows(id):
    for row in section[id].iter():
        numbers = [float(e.get("value")) for e in row.iter() if name(e) == "data"]
        if name(row) == "tr" and numbers: yield numbers
def compare(what, shown, told):
    if shown != told: print(what, "differs:", [(s, t) for s, t in zip(shown, told) if s != t][:3], len(shown), len(told))
told = []
for e in summary["budget"]["entries"]:
    degrees = e["degrees_of_freedom"]
    told.append([e["value"], e["u"], e["U"]] + ([] if degrees is None else [degrees]))
compare("budget", list(rows("budget")), told)
told = {tuple([g["observations"], g["outliers"], g["redundancy"], g["rms_px"], g["sigma_px"]])
        for s in summary["sensors"].values() for g in s["groups"].values()}
compare("noise", sorted({tuple(r[:3] + r[4:]) for r in rows("noise")}), sorted(told))
told = [[t["chi_square"], t["probability"], t["worst_probability"]] for t in summary["regional_tests"].values() if t["parts"]]
compare("patterns", sorted(rows("patterns")), sorted(told))
said = lambda id: "".join(section[id].itertext())
listed = [float(e.get("value")) for e in section["correlations"].iter() if name(e) == "data"]
compare("correlations", listed, [summary["condition"]] + [p["correlation"] for p in summary["correlated"]["strongest"]])
if summary["weakest_direction"] not in said("correlations"): print("the weakest direction is not in the report")
told = sorted({p["depth_mm"] for p in summary.get("volume_points", {"points": []})["points"]})
if any(d not in {r[0] for r in rows("volume")} for d in told): print("a depth of the volume is not in the report")
if "crumple calibrate" not in said("inputs"): print("no command line")
values = {float(e.get("value")) for e in section["sensors"].iter() if name(e) == "data"}
for sensor, cells in summary["image_cells"].items():
    for key in ("covered", "rms_mean_px", "expected_px"):
        if cells[key] not in values: print(sensor, key, "is not in the report")
words = "".join(root.itertext())
for sensor, one in summary.get("projection_uncertainty", {}).items():
    if one["distance_mm"] not in values: print(sensor, "has no map in the report")
for reason in summary["reasons"] + summary["notes"]:
    if reason not in words: print("not in the report:", reason)
if "Verdict: " + summary["verdict"] not in words: print("no verdict")
)";

// What is wrong with a folder's report; nothing where all is well.
inline std::string wrong_in_report(const std::string& folder) { return run_python(kCheckReport, folder); }

}  // namespace crumple
