"""The cache of this computer: compiled programs, and texts that are expensive to compose.

Loading compiled code runs it, so the folder is used only where no other user can write to it (``folder.py``), and a
program only where every byte has its recorded hash (``kept.py``). ``programs.py`` finds a program or has it made
(``making.py``): by one process while others wait, with a word where it takes long.
What nobody uses any more goes by itself (``tidying.py``). Texts are kept by a key of what they were composed from
(``texts.py``). If anything is wrong with the folder, the model is compiled in memory and runs; only the next start has
to compile again.
"""
