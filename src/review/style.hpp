// The style sheet of the report: one page, screen and print.
#pragma once

namespace weldcell::review {

inline constexpr const char* kStyle = R"css(
:root{--ink:#1b1f24;--soft:#57606a;--rule:#d0d7de;--paper:#fff;--tint:#f6f8fa;--blue:#0b5fa5;--red:#c8102e;--ok:#1a7f37;--again:#8a5a00;--no:#b3261e}
*{box-sizing:border-box}
body{margin:0;background:var(--tint);color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Liberation Sans",Arial,sans-serif}
main,header.top{max-width:1160px;margin:0 auto;padding:0 24px}
header.top{padding-top:28px;padding-bottom:4px}
h1{font-size:30px;line-height:1.2;margin:0}
h2{font-size:21px;margin:0 0 4px}
h3{font-size:16px;margin:18px 0 4px}
p{margin:4px 0 10px}
.meta,.note,figcaption,.unit{color:var(--soft)}
.meta{font-size:14px;margin:2px 0 14px}
.verdict{display:flex;gap:16px;align-items:center;border-radius:10px;padding:14px 18px;margin:0 0 14px;background:var(--paper);border:1px solid var(--rule);border-left-width:10px}
.verdict b{font-size:22px;white-space:nowrap}
.verdict.weld{border-left-color:var(--ok)}.verdict.weld b{color:var(--ok)}
.verdict.rescan{border-left-color:var(--again)}.verdict.rescan b{color:var(--again)}
.verdict.reject{border-left-color:var(--no)}.verdict.reject b{color:var(--no)}
.verdict.open{border-left-color:var(--blue)}.verdict.open b{color:var(--blue)}
.todo{background:#fff8e5;border:1px solid #d9b44a;border-radius:10px;padding:12px 18px;margin:0 0 14px}
.todo h2{font-size:17px}.todo ol{margin:4px 0;padding-left:22px}
.numbers{display:grid;grid-template-columns:repeat(auto-fit,minmax(230px,1fr));gap:10px;margin:0 0 14px;padding:0}
.numbers div{background:var(--paper);border:1px solid var(--rule);border-radius:10px;padding:10px 14px}
.numbers dt{font-size:13px;color:var(--soft)}
.numbers dd{margin:0;font-size:20px;font-weight:600;font-variant-numeric:tabular-nums}
.numbers .unit{font-size:14px;font-weight:400}
nav{font-size:14px;margin:0 0 14px}nav a{margin-right:14px}
a{color:var(--blue)}
section{background:var(--paper);border:1px solid var(--rule);border-radius:10px;padding:18px 20px;margin:0 0 16px}
figure{margin:10px 0 4px}
figure>svg{display:block;width:100%;height:auto;margin:0 auto}
figcaption{font-size:14px;text-align:center;margin-top:6px}
.key{display:inline-flex;align-items:center;gap:6px;margin:0 10px;white-space:nowrap}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:15px;font-variant-numeric:tabular-nums}
caption{text-align:left;color:var(--soft);font-size:14px;padding-bottom:6px}
th,td{text-align:left;padding:6px 10px;border-bottom:1px solid var(--rule);vertical-align:top}
thead th{font-size:13px;color:var(--soft);border-bottom-width:2px;vertical-align:bottom}
td.n,th.n{text-align:right;white-space:nowrap}
tbody th{font-weight:600}
.pill{display:inline-block;border-radius:99px;padding:1px 10px;font-size:13px;font-weight:600;color:#fff;white-space:nowrap}
.pill.weld{background:var(--ok)}.pill.rescan{background:var(--again)}.pill.reject{background:var(--no)}
tr.fault td{color:var(--no);font-weight:600}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:14px}
.pictures svg{width:100%;height:auto;border-radius:6px;display:block}
details{border-top:1px solid var(--rule);padding:8px 0}
summary{cursor:pointer;font-weight:600}
pre{background:var(--tint);border:1px solid var(--rule);border-radius:6px;padding:10px;overflow-x:auto;font:13px/1.45 ui-monospace,"DejaVu Sans Mono",monospace;white-space:pre-wrap;overflow-wrap:anywhere}
footer{max-width:1160px;margin:0 auto;padding:4px 24px 30px;font-size:13px;color:var(--soft)}
svg text{font-family:inherit;fill:var(--ink)}
.ground{fill:#fcfcfd;stroke:var(--rule)}
.grid{stroke:#e6eaee;stroke-width:1;fill:none}
.tick{font-size:12px;fill:#57606a;text-anchor:middle}.tick.left,.tick.end{text-anchor:end}.tick.start{text-anchor:start}
.solid{fill:#dfe6ec;stroke:#6e7781;stroke-width:1.2}
.ghost{fill:#eef1f4;stroke:#aab3bc;stroke-width:1}
.planned{fill:none;stroke:#57606a;stroke-width:1.6;stroke-dasharray:2 4;stroke-linecap:round}
.found{fill:#0b5fa514;stroke:#0b5fa5;stroke-width:2}
.truth{fill:none;stroke:#1a7f37;stroke-width:1.2;stroke-dasharray:8 4}
.beam{fill:none;stroke:#b0450b;stroke-width:1;opacity:.75}
.travelled{fill:none;stroke:#b8c4cf;stroke-width:1.2}
.crossing{fill:none;stroke:#57606a;stroke-width:1}
.seam{fill:none;stroke:#6f2da8;stroke-width:4;stroke-linecap:round}
.seam.ok{stroke:#1a7f37}.seam.again{stroke:#c98500}.seam.no{stroke:#b3261e}
.weldname{font-size:13px;font-weight:600;text-anchor:middle;paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-linejoin:round}
.marker rect{fill:#1b1f24}.marker text{fill:#fff;font-size:13px;font-weight:600;text-anchor:middle;dominant-baseline:central}
.dot{fill:none;stroke-width:3.4;stroke-linecap:round}
.dot.edge{stroke:#c8102e;stroke-width:5}.dot.outlier{stroke:#e08a00;stroke-width:5}
.dot.rising{stroke:#0b5fa5;stroke-width:5}.dot.falling{stroke:#c8102e;stroke-width:5}.dot.unknown{stroke:#57606a;stroke-width:5}
.dot.lost{stroke:#ff00c8;stroke-width:3}
.h0{stroke:#440154}.h1{stroke:#46327e}.h2{stroke:#365c8d}.h3{stroke:#277f8e}.h4{stroke:#1fa187}.h5{stroke:#4ac16d}.h6{stroke:#a0da39}.h7{stroke:#e8c81c}
.f0{fill:#440154}.f1{fill:#46327e}.f2{fill:#365c8d}.f3{fill:#277f8e}.f4{fill:#1fa187}.f5{fill:#4ac16d}.f6{fill:#a0da39}.f7{fill:#e8c81c}
.arrow{fill:none;stroke-width:1.3}.arrow.out{stroke:#c8102e}.arrow.in{stroke:#6f2da8}
.bar{fill:#8fb8de}.bell{fill:none;stroke:#0b5fa5;stroke-width:2}.axis{stroke:#57606a;fill:none}
.gauge{fill:#e6eaee}.fill.weld{fill:#1a7f37}.fill.rescan{fill:#c98500}.fill.reject{fill:#b3261e}.limit{stroke:#1b1f24;stroke-width:2}
.took{fill:#8fb8de}
@media print{body{background:#fff;font-size:11pt}nav{display:none}section,.verdict,.todo,.numbers div{break-inside:avoid;border-color:#bbb}main,header.top{max-width:none;padding:0}details{display:none}
*{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
)css";

}  // namespace weldcell::review
