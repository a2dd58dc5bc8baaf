"""Files of other programs: pgmpy 1.1.2 and pyAgrum 3.3.1, Python 3.11. Writes foreign/pgmpy.*, foreign/pyagrum.*, foreign/expected.json
and reads foreign/ours.* (which the tests compare with what the crate writes). Run: python foreign.py
"""
import json, os, tempfile
import pyagrum as gum
from pgmpy.factors.discrete import TabularCPD
from pgmpy.inference import VariableElimination
from pgmpy.models import DiscreteBayesianNetwork
from pgmpy.readwrite import BIFReader, BIFWriter, NETReader, NETWriter, XMLBIFReader, XMLBIFWriter

# Three parents' worth of configurations, unequal numbers of states, so that any wrong order of a table shows.
net = DiscreteBayesianNetwork([("season", "rain"), ("season", "sprinkler"), ("rain", "wet"), ("sprinkler", "wet")])
names = dict(season=["dry", "mild", "wet"], rain=["no", "yes"], sprinkler=["off", "on"], wet=["no", "damp", "soaked"])
state = lambda *nodes: {n: names[n] for n in nodes}
net.add_cpds(
    TabularCPD("season", 3, [[0.5], [0.3], [0.2]], state_names=state("season")),
    TabularCPD("rain", 2, [[0.9, 0.7, 0.2], [0.1, 0.3, 0.8]], ["season"], [3], state_names=state("rain", "season")),
    TabularCPD("sprinkler", 2, [[0.4, 0.6, 0.99], [0.6, 0.4, 0.01]], ["season"], [3], state_names=state("sprinkler", "season")),
    TabularCPD("wet", 3, [[0.97, 0.3, 0.2, 0.05], [0.02, 0.5, 0.5, 0.25], [0.01, 0.2, 0.3, 0.7]], ["rain", "sprinkler"], [2, 2],
               state_names=state("wet", "rain", "sprinkler")))
assert net.check_model()
BIFWriter(net).write("foreign/pgmpy.bif") if hasattr(BIFWriter(net), "write") else BIFWriter(net).write_bif("foreign/pgmpy.bif")
x = XMLBIFWriter(net)
(x.write if hasattr(x, "write") else x.write_xmlbif)("foreign/pgmpy.xmlbif")
n = NETWriter(net)
(n.write if hasattr(n, "write") else n.write_net)("foreign/pgmpy.net")
posterior = VariableElimination(net).query(["season"], evidence={"wet": "soaked", "sprinkler": "off"}, show_progress=False)
expected = [float(posterior.get_value(season=s)) for s in names["season"]]

bn = gum.BayesNet("lawn")
for v in ["season", "rain", "sprinkler", "wet"]:
    bn.add(gum.LabelizedVariable(v, v, names[v]))
for a, b in net.edges():
    bn.addArc(a, b)
bn.cpt("season")[:] = [0.5, 0.3, 0.2]
for i, s in enumerate(names["season"]):
    bn.cpt("rain")[{"season": s}] = [[0.9, 0.7, 0.2][i], [0.1, 0.3, 0.8][i]]
    bn.cpt("sprinkler")[{"season": s}] = [[0.4, 0.6, 0.99][i], [0.6, 0.4, 0.01][i]]
wet = [[0.97, 0.02, 0.01], [0.3, 0.5, 0.2], [0.2, 0.5, 0.3], [0.05, 0.25, 0.7]]
for i, r in enumerate(names["rain"]):
    for j, s in enumerate(names["sprinkler"]):
        bn.cpt("wet")[{"rain": r, "sprinkler": s}] = wet[2 * i + j]
for extension in ["bif", "bifxml", "net"]:
    gum.saveBN(bn, f"foreign/pyagrum.{extension}")
ie = gum.LazyPropagation(bn)
ie.setEvidence({"wet": "soaked", "sprinkler": "off"})
assert max(abs(a - b) for a, b in zip(ie.posterior("season").tolist(), expected)) < 1e-12

# Ours: P(rain = yes | task = pouring).
ours = 0.2 * 0.9 / (0.2 * 0.9 + 0.8 * 0.6666666666666667)
read = {}
for extension, reader in [("bif", BIFReader), ("xmlbif", XMLBIFReader), ("net", NETReader)]:
    model = reader(f"foreign/ours.{extension}").get_model()
    task = [s for s in model.get_cpds("task").state_names["task"] if s.replace("_", "-").startswith("pouring")][0]
    p = VariableElimination(model).query(["rain"], evidence={"task": task}, show_progress=False)
    read[f"pgmpy {extension}"] = float(p.get_value(rain="yes"))
for extension, name in [("bif", "ours.bif"), ("bifxml", "ours.xmlbif"), ("net", "ours.net")]:
    path = f"foreign/{name}"
    if extension == "bifxml":
        path = os.path.join(tempfile.mkdtemp(), "ours.bifxml")  # the loader goes by the extension
        open(path, "w").write(open(f"foreign/{name}").read())
    bn = gum.loadBN(path)
    ie = gum.LazyPropagation(bn)
    ie.setEvidence({"task": "pouring"})
    read[f"pyagrum {extension}"] = float(ie.posterior("rain")[{"rain": "yes"}])
for who, p in read.items():
    assert abs(p - ours) < 1e-7, (who, p, ours)  # pyAgrum reads BIF numbers in single precision
json.dump(dict(season_given_soaked_and_off=expected, ours_read_by=sorted(read)), open("foreign/expected.json", "w"), indent=1)
print(expected, read)
