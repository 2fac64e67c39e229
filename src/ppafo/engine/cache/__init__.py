"""Cache of this computer: compiled programs, and texts that are expensive to compose.

Loading compiled code executes it. The folder is therefore used only if no other user can write to it (``folder.py``),
and a program only if every file has its recorded hash (``kept.py``). ``engine/loading.py`` finds a program or has it
compiled (``making.py``): one process compiles while others wait, with a message if compilation takes long. Unused
entries are removed automatically (``tidying.py``). Texts are stored under a key of their inputs (``texts.py``). If the
folder cannot be used, the model is compiled in memory, and the next process has to compile it again.
"""
