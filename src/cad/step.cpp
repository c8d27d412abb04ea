#include <fmt/format.h>

#include <BRepBuilderAPI_Transform.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <STEPControl_Reader.hxx>
#include <StepShape_ManifoldSolidBrep.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "cad/cad_part.hpp"
#include "cad/solid.hpp"

namespace weldcell::cad {

namespace {

constexpr int kMaxAssemblyDepth = 32;

struct NamedSolid {
  std::string name;  ///< "" when the file gives none
  TopoDS_Shape shape;
};

/// The label's own name when it says something; CAD systems fill in placeholders.
std::string name_of(const TDF_Label& label) {
  Handle(TDataStd_Name) attribute;
  if (!label.FindAttribute(TDataStd_Name::GetID(), attribute)) return "";
  const TCollection_ExtendedString& wide = attribute->Get();
  std::string text(static_cast<std::size_t>(wide.LengthOfCString()) + 1, '\0');
  Standard_PCharacter into = text.data();
  const int length = wide.ToUTF8CString(into);
  text.resize(static_cast<std::size_t>(std::max(0, length)));
  std::string out;
  for (const char c : text) {
    if (static_cast<unsigned char>(c) >= 0x20 && out.size() < 60) out += c;
  }
  while (!out.empty() && out.back() == ' ') out.pop_back();
  const bool placeholder =
      out.rfind("=>", 0) == 0 || out == "SOLID" || out == "COMPOUND" || out == "COMPSOLID" ||
      out == "SHELL" || out.find_first_not_of("0123456789") == std::string::npos || out.rfind("NAUO", 0) == 0;
  return placeholder ? "" : out;
}

void collect(const TDF_Label& label, const TopLoc_Location& placed, const std::string& name, int depth,
             std::vector<NamedSolid>& out) {
  if (depth > kMaxAssemblyDepth || out.size() > kMaxMembers) return;
  if (XCAFDoc_ShapeTool::IsAssembly(label)) {
    TDF_LabelSequence components;
    XCAFDoc_ShapeTool::GetComponents(label, components);
    for (int i = 1; i <= components.Length(); ++i) {
      const TDF_Label& component = components.Value(i);
      TDF_Label part;
      if (!XCAFDoc_ShapeTool::GetReferredShape(component, part)) continue;
      std::string own = name_of(component);
      if (own.empty()) own = name_of(part);
      collect(part, placed * XCAFDoc_ShapeTool::GetLocation(component), own, depth + 1, out);
    }
    return;
  }
  const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(label).Moved(placed);
  std::vector<NamedSolid> solids;
  for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More() && solids.size() <= kMaxMembers; at.Next()) {
    solids.push_back({name, at.Current()});
  }
  // Several solids under one name are a flattened assembly: the name is the whole's, not the members'.
  for (NamedSolid& solid : solids) {
    if (solids.size() > 1 && depth == 0) solid.name.clear();
    out.push_back(std::move(solid));
  }
}

void make_names_unique(std::vector<NamedSolid>& solids) {
  std::map<std::string, int> uses, given;
  for (const NamedSolid& solid : solids) ++uses[solid.name];
  for (std::size_t i = 0; i < solids.size(); ++i) {
    std::string& name = solids[i].name;
    if (name.empty()) {
      name = "m" + std::to_string(i + 1);
    } else if (uses[name] > 1) {
      name += "_" + std::to_string(++given[name]);
    }
  }
}

gp_Trsf onto_table(Plane plane, double scale) {
  gp_Trsf turn;
  // Rotations that bring the named plane's normal up: xz looks from +Y, yz from +X.
  if (plane == Plane::Xz) turn.SetValues(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0);
  if (plane == Plane::Yz) turn.SetValues(0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0);
  gp_Trsf grow;
  grow.SetScaleFactor(scale);
  return grow * turn;
}

/// The length unit that the file declares, as mm; 0 when it declares none.
double declared_mm(STEPControl_Reader& reader, std::string& word) {
  TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
  reader.FileUnits(lengths, angles, solid_angles);
  if (lengths.IsEmpty()) return 0;
  word = lengths.First().ToCString();
  std::transform(word.begin(), word.end(), word.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  static const std::map<std::string, double> kKnown = {
      {"millimetre", 1}, {"millimeter", 1}, {"mm", 1},          {"metre", 1000},
      {"meter", 1000},   {"m", 1000},       {"centimetre", 10}, {"centimeter", 10},
      {"inch", 25.4},    {"inches", 25.4},  {"foot", 304.8},    {"micrometre", 1e-3}};
  const auto known = kKnown.find(word);
  return known == kKnown.end() ? 0 : known->second;
}

/// Geometry and topology; real files often have colours, fonts and annotations wrong, which shape no member.
bool shapes_a_member(const Handle(Interface_InterfaceModel) & model, int number) {
  if (number < 1 || number > model->NbEntities()) return true;
  const std::string type = model->Value(number)->DynamicType()->Name();
  if (type.find("Representation") != std::string::npos)
    return false;  // a list of items, annotations among them
  return type.rfind("StepGeom_", 0) == 0 || type.rfind("StepShape_", 0) == 0;
}

/// A record that does not read would be left out in silence, and the member with it; some crash the library
/// later.
Status check_records(STEPControl_Reader& reader) {
  Interface_CheckIterator checks = reader.WS()->ModelCheckList();
  int damaged = 0, first = 0;
  std::string reason;
  for (checks.Start(); checks.More(); checks.Next()) {
    const Handle(Interface_Check)& check = checks.Value();
    if (!check->HasFailed() || !shapes_a_member(reader.Model(), checks.Number())) continue;
    if (damaged++ > 0) continue;
    first = checks.Number();
    reason = check->CFail(1, Standard_True);
  }
  if (damaged == 0) return Done{};
  return fault("cad.unreadable",
               fmt::format("{} record(s) are damaged, the first is number {}: {}", damaged, first, reason),
               "is the file complete? export it again");
}

/// Every solid of the file must have come through.
Status check_complete(STEPControl_Reader& reader, const std::vector<NamedSolid>& solids) {
  const Handle(Interface_InterfaceModel) model = reader.Model();
  std::size_t in_file = 0;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    if (model->Value(i)->IsKind(STANDARD_TYPE(StepShape_ManifoldSolidBrep))) ++in_file;
  }
  std::set<const void*> translated;
  for (const NamedSolid& solid : solids) translated.insert(solid.shape.TShape().get());
  if (translated.size() >= in_file) return Done{};
  return fault("cad.unreadable",
               fmt::format("only {} of its {} solids can be translated", translated.size(), in_file),
               "heal the model in the CAD system and export it again");
}

Result<std::vector<NamedSolid>> load(const std::string& path, const Options& options, bool& inch) {
  // The library reports its progress on stdout by default, which is ours.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  STEPCAFControl_Reader reader;
  reader.SetNameMode(Standard_True);
  reader.SetColorMode(Standard_False);
  reader.SetLayerMode(Standard_False);
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
    return fault("cad.unreadable", "is not a STEP file that can be read",
                 "export it again as AP203, AP214 or AP242");
  }
  if (Status sound = check_records(reader.ChangeReader()); !sound.ok()) return sound.error();
  std::string word;
  const double declared = declared_mm(reader.ChangeReader(), word);
  inch = declared == 25.4;
  const double asked = options.units.empty() ? 0 : mm_per_unit(options.units);
  if (declared == 0 && asked == 0) {
    return fault("cad.units",
                 word.empty() ? "declares no length unit" : "declares the unknown length unit '" + word + "'",
                 "say --units mm, inch or m");
  }
  Handle(TDocStd_Document) document = new TDocStd_Document("weldcell");
  if (!reader.Transfer(document)) {
    return fault("cad.unreadable", "holds no shape that can be translated",
                 "export it again as AP203, AP214 or AP242");
  }
  Handle(XCAFDoc_ShapeTool) shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  TDF_LabelSequence free_shapes;
  shapes->GetFreeShapes(free_shapes);
  std::vector<NamedSolid> solids;
  for (int i = 1; i <= free_shapes.Length(); ++i) {
    collect(free_shapes.Value(i), TopLoc_Location(), name_of(free_shapes.Value(i)), 0, solids);
  }
  if (solids.empty())
    return fault("cad.empty", "holds no solid", "export the members as solids, not as surfaces or wires");
  if (solids.size() > kMaxMembers) {
    return fault("cad.limit", fmt::format("holds more than {} solids", kMaxMembers),
                 "export only the frame's members");
  }
  if (Status whole = check_complete(reader.ChangeReader(), solids); !whole.ok()) return whole.error();
  make_names_unique(solids);
  const gp_Trsf move = onto_table(options.plane, asked > 0 && declared > 0 ? asked / declared : 1.0);
  for (NamedSolid& solid : solids)
    solid.shape = BRepBuilderAPI_Transform(solid.shape, move, Standard_True).Shape();
  return solids;
}

struct Height {
  std::string name;
  double top_mm = 0, bottom_mm = 0;
};

/// One weldment has one top: the laser stays at one height.
Status check_level(const std::vector<Height>& heights) {
  const auto by_top = [](const Height& a, const Height& b) { return a.top_mm < b.top_mm; };
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end(), by_top);
  if (high->top_mm - low->top_mm <= 1.0) return Done{};
  return fault(
      "cad.top",
      fmt::format("the tops are not level: '{}' at {:.1f} mm, '{}' at {:.1f} mm", low->name, low->top_mm,
                  high->name, high->top_mm),
      "weldcell scans flat frames; export only the members of one level, or put another plane on the table");
}

}  // namespace

Result<CadPart> read_step(const std::string& path, const Options& options) {
  bool inch = false;
  auto solids = load(path, options, inch);
  if (!solids.ok()) return solids.error();
  CadPart part;
  std::vector<Height> heights;
  for (const NamedSolid& solid : *solids) {
    auto seen = seen_from_above(solid.shape, solid.name);
    if (!seen.ok()) return seen.error();
    heights.push_back({solid.name, seen->top_mm, seen->bottom_mm});
    part.members.push_back({solid.name, "", seen->silhouette, seen->edge_radius_mm});
    if (seen->openings > 0) {
      part.notes.push_back(fmt::format("{}: {} opening(s) in its top are not part of the outline", solid.name,
                                       seen->openings));
    }
  }
  if (Status size = check_extent(part, inch && options.units.empty()); !size.ok()) return size.error();
  if (Status level = check_level(heights); !level.ok()) return level.error();
  double top = -1e30, bottom = 1e30;
  for (const Height& h : heights) {
    top = std::max(top, h.top_mm);
    bottom = std::min(bottom, h.bottom_mm);
  }
  part.height_mm = options.height_mm > 0 ? options.height_mm : std::round((top - bottom) * 1e6) / 1e6;
  return part;
}

}  // namespace weldcell::cad
