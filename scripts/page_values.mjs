// The numbers that the page makes of texts: node page_values.mjs settings.mjs content.json configurations.json
//
// Prints a line for each configuration: its numbers as hexadecimal bytes, or why it is refused. settings.mjs is
// page/source/settings.ts, bundled by esbuild.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [module, ...files] = process.argv.slice(2);
const { contradiction, valuesOf } = await import(pathToFileURL(module).href);
const [content, configurations] = files.map((file) => JSON.parse(readFileSync(file, "utf8")));
const program = content.programs[0];
for (const changes of configurations) {
  let line;
  try {
    const values = valuesOf(content, { program: program.name, changes });
    const problem = contradiction(program, values);
    line = problem === "" ? Buffer.from(Float64Array.from(program.settings, ({ key }) => values.get(key)).buffer).toString("hex") : `refused: ${problem}`;
  } catch (error) {
    line = `refused: ${error.message}`;
  }
  console.log(line.replace(/\n/g, " "));
}
