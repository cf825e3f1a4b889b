"""The HTML page of a report, as a module: every kind of installation contains the modules."""

from string import Template

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 70rem; margin: 2rem auto;
       padding: 0 1rem; overflow-wrap: break-word; }
h1 { font-size: 1.5rem; margin-bottom: 0; }
h2 { font-size: 1.2rem; margin-top: 2rem; }
.described { margin: 0.3rem 0 0; }
.made { color: #555; margin-top: 0; }
.verdict { font-size: 1.15rem; border-left: 4px solid #2654a4; padding: 0.3rem 0 0.3rem 1rem; }
.budget, .pictures { display: grid; gap: 1.5rem;
       grid-template-columns: repeat(auto-fit, minmax(min(26rem, 100%), 1fr)); }
.budget > section { min-width: 0; }
.wide { overflow-x: auto; }
figure { margin: 0; }
img { max-width: 100%; height: auto; }
figcaption { color: #555; font-size: 0.9rem; }
table { border-collapse: collapse; width: 100%; font-size: 0.9rem; }
th { text-align: left; font-weight: normal; color: #555; vertical-align: top; }
th, td { padding: 0.2rem 1rem 0.2rem 0; border-bottom: 1px solid #ddd; }
td { font-variant-numeric: tabular-nums; overflow-wrap: anywhere; }
.wide td { overflow-wrap: normal; vertical-align: top; }
.levels th, .levels td { text-align: right; padding: 0.2rem 0 0.2rem 0.5rem; }
summary { cursor: pointer; font-size: 1.1rem; margin-top: 1rem; }
@media print {
  html { font-size: 11px; }
  body { font-size: 1rem; max-width: none; margin: 0; padding: 0; }
  h2, summary { break-after: avoid; }
  .budget, .pictures { grid-template-columns: 1fr 1fr; }
  .wide { overflow-x: visible; }
  figure, tr, li { break-inside: avoid; }
}
</style>
</head>
<body>
<h1>$title</h1>
<p class="described">$described</p>
<p class="made">$made</p>
<p class="verdict">$verdict</p>
$remarks
<div class="budget">
<section>
<h2>How sure</h2>
$counted
</section>
<section>
<h2>Not covered</h2>
$open
</section>
</div>
<h2>Pictures</h2>
<div class="pictures">
$pictures
</div>
<h2>In short</h2>
$summary
<h2>The scene</h2>
$scene
$levels
<details>
<summary>All numbers of result.json, in SI units</summary>
$numbers
</details>
<details>
<summary>Versions and input files</summary>
$provenance
</details>
<script>
addEventListener("beforeprint", () => {
  for (const part of document.querySelectorAll("details")) part.open = true;
});
</script>
</body>
</html>
""")
