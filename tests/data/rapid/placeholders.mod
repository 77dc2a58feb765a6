MODULE Placeholders
  <TDN>
  <DDN>
  VAR <ID> <ID>:=<EXP>;
  PROC p(<PAR>,<ALT>)
    <SMT>
    <VAR>:=<EXP>;
    MoveL <ARG>,v100,<EXP>,tGun;
    IF <EXP> THEN
      <SMT>
    <EIT>
    ENDIF
    TEST <EXP>
    <CSE>
    CASE 1:
      IF a<b OR a<c>d x:=a<B;
    ENDTEST
    GOTO <ID>;
  ENDPROC
  <RDN>
ENDMODULE
