#include "apps/report/parts.h"

namespace skerry::report {

const char* const kStyle = R"css(
:root { color-scheme: light dark;
  --bg:#fbfbf9; --card:#fff; --ink:#1d2127; --soft:#5b6470; --line:#dfe2e6; --track:#f0f1f3;
  --serial:#6b7280; --dedicated:#c2610c; --dedicated-jobs:#a0428f; --fork:#1f6fc4; --job:#0b8457; --other:#8a7a3c;
  --host:#e0a83c; --hostjob:#f0cd7f; --wait:#c9cdd3; --show:#d96a8b;
  --broad:#3aa6a0; --narrow:#4a7fd0; --islands:#7a68c8; --solve:#4f9d57; --rest:#8d96a3; --bad:#c0392b; }
@media (prefers-color-scheme: dark) { :root {
  --bg:#15181c; --card:#1d2126; --ink:#e7e9ec; --soft:#a3abb6; --line:#343a42; --track:#262b32;
  --serial:#9aa3af; --dedicated:#f0924a; --dedicated-jobs:#d583c5; --fork:#6fb0f5; --job:#43c38e; --other:#cbb968;
  --host:#c9952f; --hostjob:#a88a48; --wait:#4b525c; --show:#d96a8b; --bad:#ff7b6b; } }
* { box-sizing: border-box; }
body { margin:0; background:var(--bg); color:var(--ink); font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif; }
main { max-width:1120px; margin:0 auto; padding:24px 16px 64px; }
h1 { font-size:1.7rem; line-height:1.2; margin:0 0 4px; } h2 { font-size:1.3rem; margin:40px 0 8px; }
h3 { font-size:1.05rem; margin:24px 0 6px; } h4 { font-size:.95rem; margin:14px 0 4px; font-weight:600; }
p { margin:6px 0; max-width:76ch; } small, .soft { color:var(--soft); font-weight:400; } small { font-size:.85em; }
a { color:inherit; }
code, pre { font-family:ui-monospace,"DejaVu Sans Mono",monospace; font-size:.88em; }
pre { background:var(--track); padding:10px 12px; border-radius:6px; white-space:pre-wrap; overflow-wrap:anywhere; }
section.card { background:var(--card); border:1px solid var(--line); border-radius:10px; padding:16px 18px; margin:16px 0; }
ul { margin:6px 0; padding-left:1.2em; } li { margin:3px 0; max-width:80ch; }
.scroll { overflow-x:auto; -webkit-overflow-scrolling:touch; }
table { border-collapse:collapse; font-size:.88rem; font-variant-numeric:tabular-nums; }
th, td { padding:5px 10px 5px 0; text-align:right; border-bottom:1px solid var(--line); white-space:nowrap; vertical-align:top; }
th { font-weight:600; color:var(--soft); } th:first-child, td:first-child { text-align:left; }
table.facts td { white-space:normal; overflow-wrap:anywhere; text-align:left; } table.facts td:first-child { color:var(--soft); white-space:nowrap; }
.answer { display:grid; gap:10px; }
.answer > div { display:grid; grid-template-columns:minmax(150px,1.1fr) repeat(var(--loads),minmax(0,1fr)); gap:10px; align-items:start; border-top:1px solid var(--line); padding-top:10px; }
.answer .head { border:0; padding:0; color:var(--soft); font-size:.85rem; }
.answer b { display:block; } .answer .cell small { display:block; }
.chip { display:inline-block; padding:1px 8px; border-radius:99px; font-size:.84rem; font-weight:600; line-height:1.5; color:var(--c); border:1.5px solid var(--c); overflow-wrap:anywhere; }
.chip.strong { background:var(--c); color:var(--card); }
.m-serial { --c:var(--serial); } .m-dedicated_thread { --c:var(--dedicated); } .m-dedicated_thread_jobs { --c:var(--dedicated-jobs); }
.m-fork_join { --c:var(--fork); } .m-job_system { --c:var(--job); } .m-other { --c:var(--other); }
.ok { color:var(--job); font-weight:600; } .bad { color:var(--bad); font-weight:600; }
.charts { display:grid; grid-template-columns:repeat(auto-fit,minmax(min(100%,330px),1fr)); gap:16px; }
figure { margin:0; } figcaption { font-size:.9rem; font-weight:600; margin-bottom:4px; }
svg.chart { width:100%; height:auto; display:block; }
.grid { stroke:var(--line); stroke-width:1; } .tick { fill:var(--soft); font-size:11.5px; }
.limit { stroke:var(--bad); stroke-width:1.3; stroke-dasharray:5 4; } .limit-text { fill:var(--bad); font-size:11px; }
.line { fill:none; stroke:var(--c); stroke-width:2.2; stroke-linejoin:round; } .dot { fill:var(--c); stroke:var(--card); stroke-width:1; }
.band { fill:var(--c); opacity:.14; }
.legend { display:flex; flex-wrap:wrap; gap:4px 16px; font-size:.84rem; color:var(--soft); max-width:none; }
.legend i { display:inline-block; width:12px; height:12px; border-radius:3px; margin-right:6px; vertical-align:-1px; background:var(--c); fill:var(--c); }
.bars { display:grid; grid-template-columns:minmax(90px,max-content) minmax(60px,1fr) max-content; gap:6px 10px; align-items:center; font-size:.88rem; font-variant-numeric:tabular-nums; }
.bar-track { position:relative; height:18px; background:var(--track); border-radius:4px; } .bar-track.stack { display:flex; overflow:hidden; }
.bar { height:100%; border-radius:4px; background:var(--c); } .stack .bar { border-radius:0; flex:none; }
.whisker { position:absolute; top:7px; height:4px; background:var(--ink); opacity:.75; border-radius:2px; }
.mark { position:absolute; top:-2px; bottom:-2px; width:2px; background:var(--bad); }
.gantt-row { display:grid; grid-template-columns:62px 1fr; gap:8px; } .tracks { font-size:.75rem; color:var(--soft); }
.tracks div { height:27px; line-height:22px; white-space:nowrap; overflow:hidden; } .gantt { width:100%; display:block; }
.axis { position:relative; height:18px; font-size:.75rem; color:var(--soft); } .axis span { position:absolute; white-space:nowrap; }
.track { fill:var(--track); } .deadline { stroke:var(--bad); stroke-width:1.5; vector-effect:non-scaling-stroke; stroke-dasharray:4 3; }
.frame-end { stroke:var(--ink); stroke-width:1.5; vector-effect:non-scaling-stroke; }
.k-host { --c:var(--host); } .k-host_job { --c:var(--hostjob); } .k-wait { --c:var(--wait); } .k-show { --c:var(--show); }
.s-broad { --c:var(--broad); } .s-narrow { --c:var(--narrow); } .s-islands { --c:var(--islands); } .s-solve { --c:var(--solve); } .s-rest { --c:var(--rest); }
.gantt rect:not(.track) { fill:var(--c); }
details { margin:10px 0; } summary { cursor:pointer; color:var(--soft); }
@media (max-width:640px) { .answer .head { display:none; } .answer > div { grid-template-columns:1fr; gap:6px; }
  .answer .cell { display:grid; grid-template-columns:62px 1fr; gap:8px; } .answer .cell::before { content:attr(data-load); color:var(--soft); font-size:.85rem; }
  section.card { padding:12px 12px; } .bars { grid-template-columns:minmax(70px,38%) 1fr; } .bar-text { grid-column:1 / -1; color:var(--soft); margin-top:-4px; } }
@media print { :root { --bg:#fff; --card:#fff; --ink:#000; --soft:#444; --line:#ccc; --track:#eee; } body { font-size:10.5pt; } main { max-width:none; padding:0; }
  section.card, figure, .frame { break-inside:avoid; } section.card { border:0; padding:0; } .bar, .chip, .gantt, .legend i, .bar-track { print-color-adjust:exact; -webkit-print-color-adjust:exact; }
  .scroll { overflow:visible; } table { font-size:7.5pt; } }
)css";

// Paper shows everything.
const char* const kScript =
    "addEventListener('beforeprint',()=>document.querySelectorAll('details').forEach(d=>d.open=true"
    "));";

}  // namespace skerry::report
